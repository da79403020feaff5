# `make` alone lists the targets. Everything is built inside this folder, in .venv and out.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
OUT := out
LOCK := requirements.lock
# Temporary files of the tests stay in the checkout too.
PYTEST := $(BIN)/python -m pytest --basetemp=$(OUT)/tests
# Processes that share the tests, a file at a time: what a file sets up is made once. The order is
# that of `tests/conftest.py`: by number of tests, the longest files would come last.
PROCESSES ?= 2
SHARED := --numprocesses=$(PROCESSES) --dist=loadfile --no-loadscope-reorder
CHOSEN := -m "not slow"

# Modules, and the tests as pytest rewrites them, are compiled once, not in each of the hundreds of
# processes that the tests start.
unexport PYTHONDONTWRITEBYTECODE

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help demo test test-all run-tests lint lock wheel docs format figures benchmark benchmark-robots benchmark-peers \
  benchmark-save clean

help:  ## List the targets
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/make \1\t\2/p' $(MAKEFILE_LIST) | expand -t 22

demo: $(STAMP)  ## Score, choose, verify and draw shaving in the wheelchair; results in out/demo
	@mkdir -p $(OUT)
	$(BIN)/python scripts/demo.py --out $(OUT)/demo

test: $(STAMP)  ## Format, lint, types, import rules, doctests and tests: what CI runs
	@$(MAKE) --no-print-directory --jobs=2 lint run-tests

test-all: $(STAMP)  ## The same with the slow tests
	@$(MAKE) --no-print-directory --jobs=2 lint run-tests CHOSEN=

# At the same time as `lint`, most of which is one process.
run-tests: $(STAMP)
	@mkdir -p $(OUT)
	$(PYTEST) $(SHARED) $(CHOSEN)

lint: $(STAMP)  ## Format, lint, types and import rules
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports

wheel: $(STAMP)  ## Build the wheel, install it in a clean environment and run the examples with it
	@mkdir -p $(OUT)
	$(BIN)/python scripts/check_wheel.py --out $(OUT)/wheel

docs: $(STAMP)  ## Build the site into out/docs, every warning an error; needs no internet
	@mkdir -p $(OUT)
	$(BIN)/python -m sphinx --quiet --fail-on-warning --keep-going --builder html \
	  --doctree-dir $(OUT)/doctrees docs $(OUT)/docs
	@echo "wrote $(OUT)/docs/index.html"

format: $(STAMP)  ## Rewrite the code in house format and fix what can be fixed
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

figures: $(STAMP)  ## Rewrite the measured tables in README and docs from benchmarks/figures
	$(BIN)/python scripts/figures.py

benchmark: $(STAMP)  ## Print the measured numbers with machine, versions and spread
	@mkdir -p $(OUT)
	$(BIN)/python benchmarks/run.py
	$(BIN)/python benchmarks/rows.py --out $(OUT)/rows
	$(BIN)/python benchmarks/selection.py $(OUT)/rows/bathing-bed-pr2.tcs $(OUT)/rows/shaving-wheelchair-pr2.tcs

benchmark-robots: $(STAMP)  ## Measure every robot at the same tasks, and what its search misses
	$(BIN)/python benchmarks/robots.py

benchmark-peers: $(STAMP)  ## Measure the kernel beside other solvers on the same problems
	@$(BIN)/python -m pip install --disable-pip-version-check --quiet --editable '.[benchmarks]' || \
	  echo "Not every peer could be installed; what is absent is left out with a line." >&2
	$(BIN)/python benchmarks/peers.py

benchmark-save: $(STAMP)  ## Run every benchmark that a page shows, save and rewrite the pages; continues where it was
	@$(BIN)/python -m pip install --disable-pip-version-check --quiet --editable '.[benchmarks]' || \
	  echo "Not every peer could be installed; what is absent is left out with a line." >&2
	$(BIN)/python benchmarks/save_all.py
	$(BIN)/python scripts/figures.py

clean:  ## Remove everything the other targets made
	rm -rf $(VENV) $(OUT) build dist
	rm -rf .hypothesis .import_linter_cache .mypy_cache .pytest_cache .ruff_cache
	find tcs shapes studies tests scripts benchmarks examples docs -name __pycache__ -type d -prune -exec rm -rf {} + 2>/dev/null || true

lock: $(STAMP)  ## Renew requirements.lock: the newest versions that pyproject.toml allows
	@$(BIN)/python -m pip install --disable-pip-version-check --quiet uv
	$(BIN)/uv pip compile pyproject.toml --extra dev --universal --python-version 3.11 --upgrade \
	  --quiet --no-annotate --custom-compile-command 'make lock' --output-file $(LOCK)

# Installed again only when these files change; the checkout itself is what gets imported. With the
# versions of the lock file, so that a release of a dependency changes nothing.
$(STAMP): pyproject.toml $(LOCK)
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null || { \
	  echo "tcs needs Python 3.11 or newer, but '$(PYTHON)' is not. Try: make PYTHON=python3.11 $(MAKECMDGOALS)" >&2; \
	  exit 1; }
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --disable-pip-version-check --quiet \
	  --constraint $(LOCK) --editable '.[dev]'
	@touch $@
