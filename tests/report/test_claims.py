"""What papers claim: verdicts from records, and what is missing."""

from __future__ import annotations

import csv
import re
from pathlib import Path

import pytest

from strainbench.bench.records import RecordsError
from strainbench.document import Table
from strainbench.document.html import html
from strainbench.report.claims.claim import CLAIMS, Claim, Finding, Verdict
from strainbench.report.claims.evidence import Evidence, NotThereError
from strainbench.report.claims.written import audit, counted, missing, write_claims
from strainbench.report.page.claimed import claims_table

RESULTS = Path(__file__).parents[2] / "results"


def test_without_results_nothing_is_said_but_what_to_run(tmp_path):
    found = audit(tmp_path)
    silent = [c for c, f in found if f.verdict is Verdict.UNMEASURED]
    assert len(silent) > len(found) / 2
    assert all(claim.commands for claim in silent)
    programs = ("strainbench ", "python -m strainbench", "make ")
    needed = missing(tmp_path)
    assert all(c.startswith(programs) and f"{tmp_path}/" in c for c in needed)
    assert not any("results/" in c.replace(f"{tmp_path}/", "") for c in needed)


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
    own = [claim for claim in CLAIMS.values() if not claim.commands]
    assert text.count("Computed by `strainbench claims` itself") == len(own)
    assert "`--rerun`" in text
    assert ".venv/bin" in text
    assert files[1].read_text(encoding="utf-8").count("\n") == len(CLAIMS) + 1
    page = files[2].read_text(encoding="utf-8")
    assert page.startswith("<!doctype html>")
    assert page.count("<h3>") == len(CLAIMS)
    assert "src=" not in page


def test_verdicts_are_counted():
    claim = Claim("T1", "1", "It works.", (), "", lambda _: Finding(Verdict.HOLDS, ""))
    found = [(claim, claim.find(Evidence(RESULTS)))]
    assert counted(found) == "1 claim: 1 holds."
    others = [(claim, Finding(verdict, "")) for verdict in Verdict if verdict != "holds"]
    assert counted(others) == (
        "4 claims: 1 holds under conditions, 1 does not hold here, 1 is not testable here, "
        "1 is not measured yet."
    )
    assert counted(2 * (found + others)) == (
        "10 claims: 2 hold, 2 hold under conditions, 2 do not hold here, 2 are not testable here, "
        "2 are not measured yet."
    )


def test_a_line_of_the_table_has_what_is_fair_to_say_and_its_commands(tmp_path):
    _, files = write_claims(tmp_path)
    with files[1].open(encoding="utf-8", newline="") as file:
        lines = {line["claim"]: line for line in csv.DictReader(file)}
    assert lines["H4"]["what could explain a difference"] == CLAIMS["H4"].fairness
    assert lines["H4"]["command"] == CLAIMS["H4"].commands[0]
    assert lines["H15"]["command"] == "strainbench claims"


BEAMS = """\
material,young,method,step_ms,alpha,tip_x,tip_y,along,strain,wobble,violation,inverted
stiff,2e5,none,20,2,0.7,-0.6,1.29,0.3,7,0,0
stiff,2e5,none,20,6,0.6,-0.64,1.3,0.3,0,0,0
stiff,8e4,none,20,6,0.4,-0.85,1.5,0.6,0,0,0
anisotropic,5e3,lcp-qp,20,2,0.7,-0.8,1.69,0.7,288,0.08,0
anisotropic,5e3,lcp-qp,10,2,0.7,-0.8,1.69,0.7,288,0.03,0
isotropic,5e3,lcp-qp,20,2,0.9,-0.4,1.25,0.4,63,1.4,1
isotropic,5e3,sequential-cuts,20,2,0.97,-0.11,1.04,0.04,0.1,1e-9,0
isotropic,5e3,sequential-cuts,10,2,0.97,-0.11,1.04,0.04,0.1,1e-9,0
"""


def test_a_beam_that_keeps_its_limits_stands_for_isotropic_ones(tmp_path):
    (tmp_path / "volumes").mkdir()
    (tmp_path / "volumes" / "beams.csv").write_text(BEAMS, encoding="utf-8")
    seen = Evidence(tmp_path)
    found = {name: CLAIMS[name].find(seen) for name in ("H7", "H8")}
    assert found["H7"].verdict is Verdict.HOLDS
    assert "isotropic (sequential-cuts, up to 1e-9 beyond" in found["H7"].numbers
    assert "lcp-qp, up to 8e-2 beyond" in found["H7"].numbers
    assert found["H8"].verdict is Verdict.CONDITIONS
    assert "would sink as far" in found["H8"].second


@pytest.mark.parametrize(("finer", "verdict"), [(0.6, "HOLDS"), (0.8, "CONDITIONS")])
def test_linear_limits_are_late_on_both_meshes_or_under_conditions(tmp_path, finer, verdict):
    rows = [
        f"{kind},{mesh},{step},200,{top},1.25"
        for kind in ("linear", "ellipsoid")
        for mesh, top in ((2, 0.6), (4, finer))
        for step in (1, 5, 20)
    ]
    folder = tmp_path / "volumes"
    folder.mkdir()
    head = "limits,resolution,step_ms,time_ms,top,stretch"
    (folder / "fig4.csv").write_text("\n".join([head, *rows]), encoding="utf-8")
    (folder / "free.csv").write_text(
        "limits,resolution,free,time_ms,top,stretch\nlinear,2,10,235,0.7,1.2\n", encoding="utf-8"
    )
    seen = Evidence(tmp_path)
    found = {name: CLAIMS[name].find(seen) for name in ("H3", "H4")}
    assert found["H4"].verdict is Verdict[verdict]
    assert "235 ms (10)" in found["H4"].second
    assert found["H3"].verdict is Verdict.UNMEASURED


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


def test_claims_of_all_folders_stand_on_the_page_of_each(tmp_path):
    head = "claim,verdict,numbers,from another side,what could explain a difference,command\n"
    line = "T2,holds,2 times,3 times,Luck.,strainbench run swing && make failures\n"
    (tmp_path / "claims.csv").write_text(head + line)
    (tmp_path / "mine").mkdir()
    (cells,) = claims_table(tmp_path / "mine").lines
    assert html(Table("", ["", "", "", "", ""], [cells])).count("<br") == 4
    assert cells[-1].split("\\\n") == [
        "2 times",
        "*From another side*: 3 times",
        "*What could explain a difference*: Luck.",
        "`strainbench run swing`",
        "`make failures`",
    ]
    (tmp_path / "mine" / "claims.csv").write_text(head + line.replace("T2", "T3"))
    assert claims_table(tmp_path / "mine").lines[0][0] == "T3"
    (tmp_path / "claims.csv").write_text("policy,sum\n1,2\n")
    (tmp_path / "mine" / "claims.csv").unlink()
    assert not claims_table(tmp_path / "mine").lines
