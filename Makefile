# `make help` lists the targets. Everything is installed into .venv; only `make setup`, where no libLLVM
# fits Dr.Jit, and `make clients`, for the tests, reach outside the checkout, as far as they may without a password.

SHELL := /bin/bash

PYTHONS := python3 python3.13 python3.12 python3.11
# Any of these may be given, as in `make setup PYTHON=/opt/python/bin/python3`.
# PYTHON: the interpreter that .venv is made from; else the first of PYTHONS that is new enough.
# TORCH_INDEX: a package index with CPU builds of torch, for systems whose usual index serves CUDA builds (gigabytes).
# PIP_EXTRA: further options of `pip install`.
PYTHON ?=
TORCH_INDEX ?=
PIP_EXTRA ?=

# ACCEPT: of `make truths`, why recorded truths may be replaced that disagree with the new ones.
ACCEPT ?=

BIN := .venv/bin
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check \
    -c constraints.txt $(if $(TORCH_INDEX),--extra-index-url $(TORCH_INDEX)) $(PIP_EXTRA)
# Marks: what a run needs is installed, and what tests and linters need besides.
RUNS := .venv/.runs
TESTS := .venv/.tests
DOCS := .venv-docs/.made
# Tests start hundreds of processes; without compiled files each compiles all modules that it imports.
unexport PYTHONDONTWRITEBYTECODE
# A process for each core, four at most, of some GB each. Tests of a file share what it makes.
PYTEST := $(BIN)/pytest --numprocesses auto --maxprocesses 4 --dist loadfile

.PHONY: help setup llvm clients demo test test-slow test-all truths names lint docs dist textures viewer clean
.DEFAULT_GOAL := help

help:  ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "make %-10s %s\n", $$1, $$2 }' Makefile

setup: $(TESTS)  ## make .venv, and get a libLLVM if none here fits Dr.Jit

$(RUNS): pyproject.toml constraints.txt
	@for candidate in $(or $(PYTHON),$(PYTHONS)); do \
	    if "$$candidate" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2> /dev/null; then \
	        python=$$candidate; break; \
	    fi; \
	done; \
	if [ -z "$$python" ]; then \
	    echo "Python 3.11 or newer is needed; name one with: make setup PYTHON=/path/to/python3" >&2; exit 1; \
	fi; \
	venv_package=$${python##*/}-venv; \
	if ! "$$python" -c 'import ensurepip, venv' 2> /dev/null; then \
	    if [ "$$(id -u)" = 0 ] && command -v apt-get > /dev/null; then \
	        apt-get -q update && apt-get -q install -y --no-install-recommends "$$venv_package" || exit 1; \
	    else \
	        echo "$$python has no venv; on Debian and Ubuntu: apt install $$venv_package" >&2; exit 1; \
	    fi; \
	fi; \
	[ -x $(BIN)/pip ] || "$$python" -m venv --clear .venv
	@echo "Installing what a run needs into .venv; the first time takes some minutes."
	@$(PIP) -e .
	@$(BIN)/python -m visual.backend.llvm > /dev/null 2>&1 || $(MAKE) --no-print-directory llvm
	@touch $@

$(TESTS): $(RUNS)
	@echo "Installing what the tests and linters need; the first time takes some minutes."
	@$(PIP) -e '.[dev]'
	@touch $@

# Without the package, the probe's own line says what to install; what needs no gradients of pictures works all the same.
llvm:
	@as_root=; [ "$$(id -u)" = 0 ] || as_root="sudo -n"; \
	if command -v apt-get > /dev/null && $$as_root true 2> /dev/null; then \
	    $$as_root apt-get -q update && $$as_root apt-get -q install -y --no-install-recommends libllvm19 libatomic1; \
	fi; \
	$(BIN)/python -m visual.backend.llvm || true

demo: $(RUNS)  ## make the gravel of the README, a tile, rougher wherever the finger lands, into runs/gravel
	$(BIN)/retouch optimize mitsuba_scenes/gravel-tile.toml -o runs/gravel --force

test: lint clients  ## lint and the quick tests, some minutes
	$(PYTEST) -m "not slow or sentinel"

test-slow: setup clients  ## the tests that `make test` leaves out
	$(PYTEST) -m "slow and not sentinel"

test-all: lint clients  ## lint and every test
	$(PYTEST)

truths: setup  ## compute the recorded truths of the tests anew
	$(PYTEST) --record-truths $(if $(ACCEPT),--accept '$(ACCEPT)')

# Where they are missing and cannot be installed, the tests that they run are skipped, as the last lines of pytest say.
clients:  ## get Chromium and PrusaSlicer for the tests, where apt-get may without asking for a password
	@missing=$$(for program in chromium prusa-slicer; do command -v $$program > /dev/null || echo $$program; done); \
	as_root=; [ "$$(id -u)" = 0 ] || as_root="sudo -n"; \
	if [ -n "$$missing" ] && command -v apt-get > /dev/null && $$as_root true 2> /dev/null; then \
	    echo "Installing $$missing for the tests; this takes some minutes."; \
	    $$as_root apt-get -qq update && $$as_root apt-get -qq install -y --no-install-recommends $$missing > /dev/null \
	        || echo "$$missing could not be installed."; \
	fi

lint: setup  ## ruff and mypy
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

# The last commit is built, by the packages of constraints.txt. setuptools leaves times, owners and modes of files in
# the source archive, which is therefore packed anew.
$(DOCS): docs/site/requirements.txt
	@echo "Installing what the site needs into .venv-docs."
	@$(or $(PYTHON),python3) -m venv --clear .venv-docs && .venv-docs/bin/python -m pip install --quiet \
	    --disable-pip-version-check $(PIP_EXTRA) -r docs/site/requirements.txt
	@touch $@

docs: $(DOCS)  ## build the site of the documentation, build/site/index.html, in an environment of its own
	.venv-docs/bin/python -m sphinx -q -E -W --keep-going -b html -c docs/site . build/site

dist: $(TESTS)  ## build the source archive and the wheel of the last commit into dist/, the same bytes each time
	@rm -rf dist && umask 022 && export SOURCE_DATE_EPOCH=$$(git log -1 --format=%ct) && \
	folder=$$(mktemp -d) && trap 'rm -rf "$$folder"' EXIT && mkdir "$$folder"/{commit,sdist} && \
	git archive HEAD | tar -x -C "$$folder/commit" && \
	$(BIN)/python -m build --no-isolation --outdir dist "$$folder/commit" > "$$folder/log" 2>&1 \
	    || { cat "$$folder/log" >&2; exit 1; }; \
	sdist=$$(echo dist/*.tar.gz) && tar -x -C "$$folder/sdist" -f "$$sdist" && \
	tar -c -C "$$folder/sdist" --sort=name --mtime=@$$SOURCE_DATE_EPOCH --owner=0 --group=0 --numeric-owner \
	    --mode=u=rwX,go=rX --format=ustar "$$(ls "$$folder/sdist")" | gzip -9 -n > "$$sdist" && \
	ls dist/*

textures: setup  ## make the input textures anew
	$(BIN)/python -m benchmarks.bundled.textures

viewer:  ## build the 3-D viewer of the pages anew, after a change of its source (needs node)
	@folder=$$(mktemp -d) && trap 'rm -rf "$$folder"' EXIT && cd retouch/pages/viewer && \
	cp -r package.json package-lock.json build.mjs source "$$folder" && cd "$$folder" && \
	npm ci --silent && node build.mjs && cp viewer.js "$(CURDIR)/retouch/pages/viewer/"

names: setup  ## list the public names, commands and options anew, after a change that is meant
	$(BIN)/python -m tests.test_public_names

clean:  ## remove what make has made, except runs/
	rm -rf .venv .venv-docs build dist *.egg-info .pytest_cache .mypy_cache .ruff_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
