# Everything works on a fresh Debian or Ubuntu with make and Python 3.11 or newer; `make setup` brings the rest into .venv.
.DELETE_ON_ERROR:
.DEFAULT_GOAL := help
.PHONY: help setup fit test lint docs notebooks wheel-test check-long clean

PYTHON ?= python3
BIN := .venv/bin
STAMP := .venv/.setup-done
WORKERS ?= 2
COUNT ?= 100000000

# a file, or the name of a built-in material
INPUT ?= gold
OUT ?= out/$(basename $(notdir $(INPUT)))

help:
	@echo "make fit [INPUT=file|name] [OUT=path]   fit a material and write its bundle"
	@echo "make test                              run the tests"
	@echo "make check-long [COUNT=n]              search for values and gradients that are not finite, for an hour or so"
	@echo "make lint | docs | notebooks | wheel-test | setup | clean"

setup: $(STAMP)

$(STAMP): pyproject.toml constraints.txt
	@command -v $(PYTHON) >/dev/null || { echo "no $(PYTHON) found: install Python 3.11 or newer, or say make PYTHON=path" >&2; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "$(PYTHON) is too old: Python 3.11 or newer is needed, say make PYTHON=path" >&2; exit 1; }
	@tools/system-packages $(PYTHON)
	@test -x $(BIN)/pip || $(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable '.[test,docs]'
	@touch $@

fit: setup
	@mkdir -p $(dir $(OUT))
	$(BIN)/jaxbrdf fit $(INPUT) -o $(OUT)

test: setup
	$(BIN)/python -m pytest -n $(WORKERS) --dist worksteal --durations=30 --durations-min=5

lint: setup
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/pyright

docs: setup
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict --quiet

notebooks: setup
	$(BIN)/python -m pytest --nbmake --nbmake-timeout=900 experiments

wheel-test: setup
	tests/wheel/run $(BIN)/python

check-long: setup
	$(BIN)/python -m experiments.check_long --count $(COUNT)

clean:
	rm -rf .venv build dist site out .pytest_cache .ruff_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
