# Everything from a fresh clone, with nothing but Python 3.11 or later: make test, make benchmark.

PYTHON ?= python3
JOBS ?= 2
HASHES ?= # 1: install only files whose hashes are in requirements.lock, torch aside
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
EXTRAS := plot,data,formats,baselines,agents,bench,export,rig,cluster,dev
COMMA := ,
INSTALL := $(BIN)/python -m pip --disable-pip-version-check --no-input install -qq
PLAIN := tests/hysteresis tests/kernels tests/plants/test_golden_plants.py $(addprefix tests/envs/, core/test_bits.py core/test_everyday.py core/test_own_family.py test_golden_trajectories.py)

# One thread each for linear algebra: more are slower on small problems, and change what is learned.
export OMP_NUM_THREADS ?= 1
export MPLBACKEND ?= Agg
export SDL_VIDEODRIVER ?= dummy

.NOTPARALLEL:
.DEFAULT_GOAL := help
.PHONY: help venv benchmark test lint format types layers check audit hashes licences images docs docs-check wheel install-check clean

help: ## Show this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / {printf "  make %-10s %s\n", $$1, $$2}' Makefile

# .begun marks an environment that is being made. Whoever finds it starts anew, because half an
# install looks like a whole one. The last step turns the mark into the stamp.
$(READY): pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit("pam-envs needs Python 3.11 or later, and this is %d.%d: make PYTHON=python3.12" % sys.version_info[:2] if sys.version_info < (3, 11) else 0)'
	@if test -e $(VENV)/.begun; then rm -rf $(VENV); fi
	@mkdir -p $(VENV) && rm -f $(READY) && touch $(VENV)/.begun
	@echo "Making $(VENV); the first time takes some minutes"
	@$(PYTHON) -m venv $(VENV)
	@if test -n "$(HASHES)"; then $(INSTALL) --require-hashes --no-deps --requirement requirements.lock; fi
	@$(INSTALL) "$$(grep '^torch==' constraints.txt)"
	@$(INSTALL) --editable ".[$(EXTRAS)]" --constraint constraints.txt
	@mv $(VENV)/.begun $(READY)

venv: $(READY) ## Make .venv with everything

benchmark: $(READY) ## Score every controller and write the leaderboard
	$(BIN)/python -m benchmarks run --pages

test: $(READY) ## Run the tests: a part without the compiler, then all
ifneq ($(PLAIN),)
	PAM_ENVS_COMPILE=0 $(BIN)/python -m pytest --quiet --numprocesses $(JOBS) --dist loadgroup $(PLAIN)
endif
	$(BIN)/python -m pytest --numprocesses $(JOBS) --dist loadgroup

lint: $(READY) ## Check style and format
	$(BIN)/ruff check --quiet .
	$(BIN)/ruff format --quiet --check .

format: $(READY) ## Mend style and format
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

types: $(READY) ## Check types
	$(BIN)/mypy pam_envs sweeps baselines agents benchmarks

layers: $(READY) ## Check which way imports run
	$(BIN)/lint-imports --no-logo

check: lint types layers test ## All of the above checks

audit: $(READY) ## Look up known vulnerabilities of the pinned packages
	@$(INSTALL) pip-audit --constraint constraints.txt || { echo "make audit needs the network, to install pip-audit" >&2; exit 1; }
	@$(BIN)/pip-audit --strict --progress-spinner off --no-deps --disable-pip --requirement constraints.txt || { echo "make audit: a pinned package has a known vulnerability, or the public list does not answer; see above" >&2; exit 1; }

hashes: $(READY) ## Write the hashes of the pinned packages into requirements.lock
	@$(INSTALL) uv
	@mkdir -p build && echo "torch; python_version < '3'" > build/without_torch.txt
	@grep '^#' requirements.lock > build/requirements.lock
	$(BIN)/uv pip compile --quiet pyproject.toml $(foreach extra,$(subst $(COMMA), ,$(EXTRAS)),--extra $(extra)) \
		--constraint constraints.txt --override build/without_torch.txt --python-version 3.11 --universal \
		--generate-hashes --no-header --no-annotate --output-file build/hashes.txt
	@cat build/hashes.txt >> build/requirements.lock && mv build/requirements.lock requirements.lock

licences: $(READY) ## Write the licences of the pinned packages into docs/licences.md
	$(BIN)/python docs/make_licences.py

images: $(READY) ## Draw the pictures of the documentation
	$(BIN)/python -m benchmarks show MusclePositioning-v0 --controller inverse_pid --reference staircase --load 2.55 --episode-seconds 40 --title "Inverse of the hysteresis with PID, load 2.55 kg" --plot docs/images/muscle_positioning.png
	$(BIN)/python docs/make_images.py
	$(BIN)/pam-envs render KneeWalk --seconds 5 --fps 10 --video docs/images/knee_walk.gif

$(VENV)/.docs: $(READY)
	@$(INSTALL) --editable ".[docs]" --constraint constraints.txt
	@$(INSTALL) --no-deps axe-playwright-python==0.1.8 # axe-core alone, without the browser driver
	@touch $@

build/docs-extra/board: $(READY)
	$(BIN)/python -m benchmarks site --out $@

build/docs-extra/playground: $(READY)
	$(BIN)/python -m benchmarks playground --out $@

docs: $(VENV)/.docs build/docs-extra/board build/docs-extra/playground ## Build the documentation site into build/docs
	$(BIN)/python docs/make_notebooks.py --check
	@echo "Building build/docs; the first time, and after a change of a tutorial, it is executed: up to ten minutes"
	$(BIN)/python -m sphinx --quiet --fail-on-warning --keep-going --doctree-dir build/docs-doctrees --conf-dir docs . build/docs

docs-check: docs ## Look for broken links and errors of the built site in a browser
	$(BIN)/python -m tests.docs.site_checks build/docs

wheel: $(READY) ## Build the wheel with compiled code of the default configurations
	$(BIN)/python -m pam_envs.export.shipping
	$(BIN)/python -m pip wheel --quiet --no-deps --wheel-dir dist .

install-check: ## Install wheel and sdist into empty environments of PYTHON, run the start page
	rm -rf build/install && mkdir -p build/install
	$(PYTHON) -m venv build/install/build && build/install/build/bin/pip install -qq hatchling
	build/install/build/bin/python -m hatchling build -d build/install/dist
	for file in build/install/dist/pam_envs-*.whl build/install/dist/pam_envs-*.tar.gz; do \
		rm -rf build/install/venv && $(PYTHON) -m venv build/install/venv && \
		build/install/venv/bin/pip install -qq "$$file[baselines]" && \
		build/install/venv/bin/python -P tests/run_page.py docs/start.md && \
		build/install/venv/bin/pam-envs doctor || exit 1; done

clean: ## Remove .venv, caches and builds; results stay
	rm -rf $(VENV) build dist pam_envs/kernels/objects .pytest_cache .ruff_cache .mypy_cache .import_linter_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
