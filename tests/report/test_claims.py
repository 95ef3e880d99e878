"""What papers claim: verdicts from records, and what is missing."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from strainbench.bench.records import RecordsError
from strainbench.report.claims.claim import CLAIMS, Claim, Finding, Verdict
from strainbench.report.claims.evidence import Evidence, NotThereError
from strainbench.report.claims.written import audit, counted, missing, write_claims

RESULTS = Path(__file__).parents[2] / "results"


def test_without_results_nothing_is_said_but_what_to_run(tmp_path):
    found = audit(tmp_path)
    silent = [c for c, f in found if f.verdict is Verdict.UNMEASURED]
    assert len(silent) > len(found) / 2
    assert all(claim.commands for claim in silent)
    assert all(
        c.startswith(("strainbench ", "python -m strainbench")) and f"{tmp_path}/" in c
        for c in missing(tmp_path)
    )


def test_claims_come_by_paper_and_number(tmp_path):
    names = [claim.name for claim, _ in audit(tmp_path)]
    assert sorted(names, key=lambda n: (n[0] != "T", int(n[1:]))) == names
    assert set(names) == set(CLAIMS)


def test_a_verdict_follows_from_the_rows():
    found = {c.name: f for c, f in audit(RESULTS)}
    energies = (RESULTS / "fig4" / "energy.md").read_text(encoding="utf-8")
    sap = re.search(r"SAP, newton-ipm, dt = 10 ms \| 200 .*?\| (-44\.\d+) \|", energies)
    assert sap
    assert f"{float(sap[1]):.1f} mJ" in found["T14"].numbers
    assert found["T14"].verdict is Verdict.HOLDS
    assert found["T13"].verdict is Verdict.CONDITIONS  # between the sampled directions it does not


def test_the_document_has_each_claim_with_its_command(tmp_path):
    told, files = write_claims(tmp_path)
    text = files[0].read_text(encoding="utf-8")
    assert told in text
    for claim in CLAIMS.values():
        assert f"### {claim.name} (" in text
        assert all(command in text for command in claim.commands)
    assert files[1].read_text(encoding="utf-8").count("\n") == len(CLAIMS) + 1
    page = files[2].read_text(encoding="utf-8")
    assert page.startswith("<!doctype html>")
    assert page.count("<h3>") == len(CLAIMS)
    assert "src=" not in page


def test_verdicts_are_counted():
    claim = Claim("T1", "1", "It works.", (), "", lambda _: Finding(Verdict.HOLDS, ""))
    assert counted([(claim, claim.find(Evidence(RESULTS)))]) == "1 claims: 1 holds."


def test_missing_rows_are_named():
    with pytest.raises(NotThereError, match="fig4 holds no cell with solver nobody"):
        Evidence(RESULTS).one("fig4", solver="nobody")
    with pytest.raises(NotThereError, match="nowhere holds no results"):
        Evidence(RESULTS).one("nowhere")


def test_damaged_records_are_no_missing_ones(tmp_path):
    (tmp_path / "fig4").mkdir()
    (tmp_path / "fig4" / "runs.csv").write_text("no,header\n1,2\n", encoding="utf-8")
    with pytest.raises(RecordsError, match=r"runs\.csv"):
        audit(tmp_path)
