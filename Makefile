# SPDX-License-Identifier: GPL-3.0-or-later
# `make demo` shows the main job on a simulated flight controller, `make test` runs the tests. Both set up their
# dependencies in .venv, given python3 >= 3.11 with venv, and make. All packages are pinned by hash; none needs a compiler.
#
#   make demo           run the demonstration, and stay up for Mission Planner to connect
#   make demo ONCE=1    the same, but exit afterwards
#   make test           run all tests (ARGS="tests/storage -x" runs some)
#   make lint           check style, format and types
#   make bench          measure speed and memory
#   make pictures       retake the docs' pictures of the status page, and the README's terminal cast
#   make real-board IMAGE=X.elf  run Harakiri with the patch, built by you, on the emulated board (CUTS=20: fewer power cuts;
#                       FLY=1: flights too)
#   make soak           kill -9 and damaged stores by the hundred, networks of 50 daemons cut, every power cut of the flash,
#                       random searches with 8 times the seeds (tests/support/seeds.py), then the daemon under events and
#                       attacks for 30 min (MINUTES=10: for ten; SOAK_SEED=7: others)
#   make fuzz           10,500,000 random inputs over UDP, TCP and UART and in files, then each search of the tests with
#                       1,000 examples instead of 40: hours (EXAMPLES=500: a 26th of the inputs)
#   make deb            build the Debian packages for amd64, arm64 and armhf in dist/ (ARCH=arm64: only that one)
#   make image-check    the first hour in a bare Debian with systemd: install, setup, a verified mission (root)
#   make release VERSION=0.3.0  cut the changelog, tag, and build everything in dist/0.3.0 with checksums; pushes nothing
#   make deb-trial      install, use and purge it in a bare Debian with systemd (root; SUITE=trixie: Debian 13;
#                       SUITE=bookworm-to-trixie: after an upgrade of the system)
#   make pi-trial       boot it as a Raspberry Pi 3 in QEMU: missions, hotspot, first start, pulls of the plug (root)
#   make suite-trial    all tests in a bare Debian, as root and as a user (root; SUITE=trixie: Debian 13)
#   make lock           pin the newest packages that pyproject.toml allows (needs uv)
#   make cli-page       regenerate docs/cli.md
#   make rules-page     regenerate the tables of docs/mission-rules.md
#   make rights-page    regenerate the tables of docs/rights.md from protocols/rights/
#   make inav-page      regenerate the table of docs/inav.md
#   make config-sample  regenerate examples/config.toml
#   make zenoh-schemas  regenerate payloads/schemas/ from the payload types
#   make clean          remove all generated files that are not in git

# The system's first: the Debian package runs on it, and unlike many others it is built with optimizations.
PYTHON ?= $(shell for python in /usr/bin/python3 python3; do \
    $$python -c 'import sys, ensurepip, venv; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && break; done; echo $$python)
UV ?= uv
# Most tests wait for programs, so two cores can run six at once.
JOBS ?= 6
VENV := .venv
BIN := $(VENV)/bin

.NOTPARALLEL:
.PHONY: rules-page rights-page demo test lint bench pictures real-board soak fuzz deb release deb-trial suite-trial pi-trial image-check lock config-sample cli-page inav-page zenoh-schemas clean

# The programs that the tests use, with their Debian packages: installed if missing and if run as root, like the compilers
# of firmware/. Without one of the needed programs there is no test run, without one of the others its tests are skipped.
NEEDED := cc:build-essential ssh-keygen:openssh-client
OTHERS := chromium:chromium chromedriver:chromium-driver systemd-analyze:systemd
missing = $$(for each in $(1); do command -v $${each%:*} >/dev/null || printf '%s ' $${each\#*:}; done)
# For tests of the installed Debian package: needs permission to create namespaces, which some containers lack.
BARE_ROOT := { $(BIN)/python tests/support/bare_root.py; } >/dev/null 2>&1
INSTALL = if [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null; then \
	  echo "installing $(1)"; \
	  apt-get update -q >/dev/null && DEBIAN_FRONTEND=noninteractive apt-get install -qy --no-install-recommends $(1) >/dev/null; \
	fi

demo: $(VENV)/.demo-ready
	$(BIN)/naze-bridge demo $(if $(ONCE),--once)

# Each program that a test starts would compile all its modules again.
test: export PYTHONDONTWRITEBYTECODE =
test: $(VENV)/.test-ready
	@packages=$(call missing,$(NEEDED) $(OTHERS)); test -z "$$packages" || { $(call INSTALL,$$packages); } || true
	@packages=$(call missing,$(NEEDED)); test -z "$$packages" || { \
	    echo "make test needs more programs: sudo apt-get install $$packages" >&2; exit 1; }
	@packages=$(call missing,$(OTHERS)); test -z "$$packages" || \
	    echo "NOT TESTED is what needs these packages: sudo apt-get install $$packages"
	@$(MAKE) -s -C firmware tools
	@$(BARE_ROOT) || echo 'The Debian package: NOT INSTALLED anywhere: no namespaces can be made here'
	$(BIN)/python -m pytest --numprocesses $(JOBS) --dist loadfile --no-loadscope-reorder $(ARGS)

# Turns of phrase that are not English, or say again what a name says; CONTRIBUTING.md has the rule.
UN_ENGLISH := whoever|whomever|anew|amidst|somebody|anybody|everybody|hung up on|at the most|stands (still|in the way)|patience|(is|are|was|were|be) taken for|looked for on
UN_ENGLISH := \b($(UN_ENGLISH)|(what|who) (comes|goes|stands)|(Return|Tell)s? (what|when|how|whether|which|who|where|why))\b

lint: $(VENV)/.test-ready
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	! git grep -nE '$(UN_ENGLISH)' -- ':!LICENSE' ':!Makefile' ':!CONTRIBUTING.md'
	! git grep -nE '^(<{7}|>{7}) '

bench: $(VENV)/.test-ready
	$(BIN)/python -m benchmarks $(ARGS)

# The docs' pictures of the status page, taken by its tests.
pictures: $(VENV)/.test-ready
	PYTHONPATH=. $(BIN)/python tests/support/take_pictures.py
	$(BIN)/python -m generators.terminal_cast > docs/pictures/demo.svg

real-board: $(VENV)/.test-ready
	@test -n '$(IMAGE)' || { echo 'Say which image: make real-board IMAGE=path/to/X.elf' >&2; exit 1; }
	NAZE_IMAGE='$(IMAGE)' NAZE_CUTS=$(or $(CUTS),200) NAZE_FLY='$(FLY)' NAZE_MISSIONS='$(MISSIONS)' $(BIN)/python -m pytest tests/real_board --timeout 0 $(ARGS)

soak: $(VENV)/.test-ready
	STORE_KILLS=200 STORE_DAMAGES=300 $(BIN)/python -m pytest --timeout 0 \
	    tests/storage/test_store_durability.py tests/storage/test_salvage.py
	UPLOADS=200 $(BIN)/python -m pytest --timeout 0 tests/scenarios/test_qgc_uploads.py
	SEEDS=8 $(BIN)/python -m pytest --timeout 0 --numprocesses $(JOBS) tests/bridge tests/protocols
	FLEET_DAEMONS=50 FLEET_CUTS=5 $(BIN)/python -m pytest tests/fleet/test_fleet_soak.py
	$(MAKE) -C firmware test
	SOAK_MINUTES=$(or $(MINUTES),30) $(BIN)/python -m pytest tests/e2e/test_soak.py $(ARGS)

fuzz: $(VENV)/.test-ready
	FUZZ_EXAMPLES=$(or $(EXAMPLES),13000) $(BIN)/python -m pytest tests/scenarios/test_fuzz.py --timeout 0 --numprocesses $(JOBS) $(ARGS)
	FUZZ_EXAMPLES=1000 $(BIN)/python -m pytest -m hypothesis --ignore tests/scenarios/test_fuzz.py --timeout 0 --numprocesses $(JOBS) $(ARGS)

deb: $(VENV)/.demo-ready
	$(BIN)/python -m deb.build $(ARCH)
	! command -v lintian >/dev/null || lintian --allow-root --fail-on error,warning $(or $(ARCH:%=dist/*_%.deb),dist/*.deb)

release: $(VENV)/.demo-ready
	@test -n '$(VERSION)' || { echo 'Say which version: make release VERSION=0.3.0' >&2; exit 1; }
	$(BIN)/python -m deb.release $(VERSION)

deb-trial image-check: ARCH = $(shell dpkg --print-architecture)
deb-trial: deb
	deb/trial dist/naze-bridge_*_$(ARCH).deb deb/trial-inside $(SUITE)

image-check: deb
	deb/trial dist/naze-bridge_*_$(ARCH).deb deb/first-hour-inside $(SUITE)

pi-trial: $(VENV)/.test-ready
	$(BIN)/python -m deb.pi_trial $(ARGS)

suite-trial:
	deb/suite-trial $(or $(SUITE),bookworm) '$(ARGS)'

# The project itself is installed editable, so that edits take effect. Its build backend comes from the lock, too;
# --no-deps because pip would complain about packages deliberately left out of the lock (pyproject.toml, tool.uv).
PIP_INSTALL = $(BIN)/python -m pip --disable-pip-version-check install --quiet --no-deps
define set_up
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	    echo 'naze-bridge needs Python 3.11 or newer as $(PYTHON); name another one: make PYTHON=python3.12' >&2; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' || { \
	    echo 'naze-bridge needs the venv module of $(PYTHON); on Debian: apt-get install python3-venv' >&2; exit 1; }
	@echo 'Installing $< in $(VENV)'
	@test -x $(BIN)/pip || $(PYTHON) -m venv $(VENV)
	@$(PIP_INSTALL) --require-hashes --only-binary=:all: --retries 2 -r $< 2>$(VENV)/pip.log || { \
	    if grep -q ConnectionError $(VENV)/pip.log; then echo 'The packages cannot be fetched: is there a network?' >&2; \
	    else cat $(VENV)/pip.log >&2; fi; exit 1; }
	@$(PIP_INSTALL) --no-build-isolation --editable .
	@touch $@
endef

$(VENV)/.demo-ready: requirements.lock pyproject.toml
	$(set_up)

$(VENV)/.test-ready: requirements-dev.lock pyproject.toml
	$(set_up)

PIN = $(UV) pip compile --quiet --upgrade --universal --python-version 3.11 --generate-hashes --no-annotate \
    --custom-compile-command 'make lock' pyproject.toml --group build
lock:
	$(PIN) --output-file requirements.lock
	$(PIN) --constraint requirements.lock --group test --group lint --output-file requirements-dev.lock

cli-page: $(VENV)/.test-ready
	$(BIN)/python -m generators.cli_page > docs/cli.md

# The table of INAV's and MultiWii's treatment of each command.
inav-page: $(VENV)/.test-ready
	PYTHONPATH=. $(BIN)/python tests/support/nav_rows.py > docs/inav.table
	sed -i -e '/begin: make inav-page/,/end: make inav-page/{/make inav-page -->/!d}' -e '/begin: make inav-page/r docs/inav.table' docs/inav.md
	rm docs/inav.table

# The table of Harakiri's records for each command.
rules-page: $(VENV)/.test-ready
	$(BIN)/python -m generators.rules_page > docs/rules.table
	$(BIN)/python -m generators.rules_page flights > docs/flights.table
	sed -i -e '/begin: make rules-page/,/end: make rules-page/{/make rules-page.* -->/!d}' \
	    -e '/begin: make rules-page -->/r docs/rules.table' \
	    -e '/begin: make rules-page flights -->/r docs/flights.table' docs/mission-rules.md
	rm docs/rules.table docs/flights.table

# The table of the effect of each request.
rights-page: $(VENV)/.test-ready
	$(BIN)/python -m generators.rights_page > docs/rights.new
	mv docs/rights.new docs/rights.md

# The sample file of all settings.
config-sample: $(VENV)/.test-ready
	$(BIN)/python -m generators.config_sample > examples/config.toml

# The published schemas, and their page.
zenoh-schemas: $(VENV)/.test-ready
	$(BIN)/python -m generators.zenoh_schemas
	$(BIN)/python -m generators.zenoh_page

clean:
	rm -rf $(VENV) build dist .demo .hypothesis .mypy_cache .pytest_cache .ruff_cache benchmarks/results
	find . -name __pycache__ -prune -exec rm -rf {} +
