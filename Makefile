# Every target sets up its own virtual environment first; `make help` lists them.

PYTHON ?= python3
VENV   ?= .venv
BIN    := $(VENV)/bin
LOCAL  := results/local
BENCH  ?= $(LOCAL)/bench
PAPER  ?= $(LOCAL)/paper
FIELD  ?= $(LOCAL)/field
FAILURES ?= $(LOCAL)/failures
DIRECTIONS ?= $(LOCAL)/directions
CERTIFICATES ?= $(LOCAL)/certificates
HARD   := --set resolution=10 --time-limit 20 --results $(FAILURES)
TESTS  := $(BIN)/python -m pytest -q --numprocesses=2 --dist=loadgroup
TABLE1 := --solver newton-ipm,clarabel,clarabel-default,clarabel-paper,cvxpy,ipopt,ipopt-default,ipopt-default-lbfgs \
	--solver gauss-seidel,fast-projection,fast-projection-full-step,none

.DEFAULT_GOAL := help
.PHONY: help setup bench bench-paper field failures directions certificates test quick faults check coverage claims results paper docs graph perf kernels report thumbnails clean

help: ## this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / {printf "  make %-12s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

setup: $(VENV)/.done ## a virtual environment with everything, Ipopt included

bench: setup ## Table 1 in a few minutes: swing at 10 and 20 cells, 1% and 10%, 10 steps
	$(BIN)/strainbench run swing $(TABLE1) --set resolution=10,20 --set limit=1%,10% \
		--steps 10 --time-limit 30 --results $(BENCH)
	$(BIN)/strainbench report --results $(BENCH)

bench-paper: setup ## the paper's whole grid, 100 steps; hours, resumable, 5 minutes a cell at most
	$(BIN)/strainbench run swing $(TABLE1) --set resolution=10,20,40,60 --set limit=1%,10% \
		--steps 100 --time-limit 300 --results $(PAPER)
	$(BIN)/strainbench report --results $(PAPER)

field: setup ## every method on the same frames: swing at 20 and 40 cells, 1%; half an hour
	$(BIN)/strainbench run swing --mode replay --set resolution=20,40 --steps 10 \
		--time-limit 60 --results $(FIELD)
	$(BIN)/strainbench report --results $(FIELD)

failures: setup ## where methods fail: hard cases beside easier neighbours; hours, resumable
	$(BIN)/strainbench run twist $(HARD) --set turn_rate=1200,300 --steps 1
	$(BIN)/strainbench run stress $(HARD) --set case=slivers,mass-ratio,displaced \
		--set severity=1,0.1 --steps 1
	$(BIN)/strainbench run stress $(HARD) --set case=slivers,displaced --set severity=3 --steps 1
	$(BIN)/strainbench run stress $(HARD) --set case=mass-ratio --set severity=2 --steps 1
	$(BIN)/strainbench run stress $(HARD) --set case=fast-pins --set severity=1,0.1 --steps 3
	$(BIN)/strainbench run stress $(HARD) --set case=pulled-pins --set severity=1,0.1 --steps 4
	$(BIN)/strainbench run stress $(HARD) --set case=collapsed,flattened,inverted \
		--set severity=1,0.1 --steps 1
	$(BIN)/strainbench run stress $(HARD) --set severity=1,0.1 --steps 1 \
		--set case=shuffled,rotated,millimetres,kilometres,far
	$(BIN)/strainbench run stress $(HARD) --set case=displaced --set severity=0.1 \
		--set limit=0.01%,0 --steps 1
	$(BIN)/strainbench run spike $(HARD) --set severity=1,0.1 --steps 60
	$(BIN)/strainbench run stretch-square $(HARD) --set scale_x=2,1.1 --steps 1
	$(BIN)/strainbench run swing $(HARD) --set limit=1%,0.1%,0.01% --steps 10 --mode replay
	$(BIN)/strainbench report --results $(FAILURES)

directions: setup ## what sampled directions cost, and how far the true stretch goes beyond them
	$(BIN)/strainbench run swing --solver newton-ipm,clarabel,admm,gauss-seidel-principal --mode replay \
		--set resolution=10 --set directions=2,4,8,18,36,exact --steps 10 --time-limit 60 \
		--results $(DIRECTIONS)
	$(BIN)/strainbench report --results $(DIRECTIONS)

certificates: setup ## 200 random problems with all solvers: no certificate contradicted; an hour
	$(BIN)/python -m pytest -q tests/referee/test_certificates.py --problems 200 \
		--tally $(CERTIFICATES)/tally.md

test: setup ## the tests
	$(TESTS)

quick: setup ## the tests without the slow ones: under a minute once compiled
	$(TESTS) -m "not slow"

faults: setup ## runs, workers and disks killed, filled and damaged, 20 at random; a table; an hour
	$(BIN)/python -m pytest -q -m faults --kills 20 tests/bench tests/test_files.py

check: setup ## format, lint, types, tests
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/mypy examples docs tests/imports.py
	$(TESTS)

coverage: setup ## what the tests reach, as a table and in results/local/coverage/html; no threshold
	$(TESTS) --cov --cov-report=term --cov-report=html

claims: setup ## what the papers claim beside what results/ holds, with verdicts: results/claims.md
	$(BIN)/strainbench claims

results: setup ## which folders of results/ are older than the code that they measure; their commands
	$(BIN)/python -m strainbench.report.freshness results

paper: setup ## the article, its numbers, tables and figures read from results/: paper/build/article.pdf; needs LaTeX
	$(BIN)/python -m strainbench.report.cited paper
	@command -v pdflatex >/dev/null || { echo "The rest needs LaTeX: pdflatex, bibtex."; exit 1; }
	cd paper && for pass in latex bibtex latex latex; do case $$pass in \
		bibtex) bibtex -terse build/article;; \
		*) pdflatex -interaction=batchmode -halt-on-error -output-directory=build article.tex;; \
		esac || exit 1; done

docs: setup ## the documentation, into results/local/docs/index.html; broken links fail it
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict

graph: setup ## the rooms of the code: floors, lines, what imports what, and what does so upwards
	$(BIN)/python -m tests.imports

perf: setup ## pytest-benchmark on recorded frames, certificates beside; results/local/perf.md, .svg
	@mkdir -p $(LOCAL)
	$(BIN)/python -m pytest tests/perf -o addopts= --benchmark-quiet --benchmark-json=$(LOCAL)/perf.json
	$(BIN)/strainbench report --results $(LOCAL)/perf.json

kernels: setup ## the solvers' compiled loops against the same in C, in turns; needs cc
	$(BIN)/python -m tests.kernels

report: setup ## tables and charts from results/local/bench again
	$(BIN)/strainbench report --results $(BENCH)

thumbnails: setup ## a small picture of each scene, into results/thumbnails; a minute or two
	$(BIN)/python -m strainbench.render.thumbnails

clean: ## remove the virtual environment and caches, keep every result
	rm -rf $(VENV) .mypy_cache .ruff_cache .pytest_cache .hypothesis .benchmarks .import_linter_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

$(VENV)/.done: pyproject.toml Makefile
	@$(PYTHON) -c 'import sys; v = sys.version_info[:2]; \
		sys.exit(0 if v >= (3, 11) else f"strainbench needs Python 3.11 or later; $(PYTHON) is {v[0]}.{v[1]}: make PYTHON=python3.11")'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install -q --disable-pip-version-check -e '.[dev,docs,pardiso]'
	@$(MAKE) --no-print-directory ipopt || \
		echo "Ipopt could not be set up (see above): the ipopt solvers will be unavailable, the rest works."
	@touch $@

# PyPI has no cyipopt wheel for Linux: build it on the Ipopt inside casadi's wheel, with PyPI's
# pkgconf (its bare executable: pip's isolated build hides its Python wrapper).
.PHONY: ipopt
ipopt:
	$(BIN)/python -m pip install -q --disable-pip-version-check 'casadi>=3.7' 'pkgconf>=2.3'
	@set -e; \
	casadi=$$(cd / && $(abspath $(BIN))/python -c 'import casadi, os; print(os.path.dirname(casadi.__file__))'); \
	pkgconf=$$(cd / && $(abspath $(BIN))/python -c 'import pkgconf; print(pkgconf.get_executable())'); \
	tools=$(abspath $(VENV))/ipopt-build; mkdir -p $$tools; ln -sf $$pkgconf $$tools/pkg-config; \
	printf '%s\n' 'Name: ipopt' 'Description: Ipopt in the casadi wheel' 'Version: 3.14' \
		"Cflags: -I$$casadi/include/coin-or" "Libs: -L$$casadi -lipopt" > $$tools/ipopt.pc; \
	PATH=$$tools:$$PATH PKG_CONFIG_PATH=$$tools LDFLAGS="-Wl,-rpath,$$casadi" \
		$(BIN)/python -m pip install -q --disable-pip-version-check --no-binary cyipopt 'cyipopt>=1.5'; \
	(cd / && $(abspath $(BIN))/python -c 'import cyipopt')
