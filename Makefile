# Everything a user or a contributor types. Needs make and Python 3.11 or newer, nothing else.
#
# The environment lives in .venv. Two stamp files in it say what was installed: demo.stamp (what runs)
# and dev.stamp (what runs, and what tests). A stamp is written last, so a failed installation leaves
# none, and the next run tries again.

PYTHON ?= python3
ROBOT ?= ur5
PYTEST_ARGS ?=
WORKERS ?= 2

VENV := .venv
PY := $(VENV)/bin/python
RULES := $(PY) -m ruff check .
FORMAT := $(PY) -m ruff format --check .
TYPES := $(PY) -m mypy .

# The half of the types that `make test` checks; `make lint` checks those of the tests, too.
PRODUCT_TYPES := $(PY) -m mypy simplemsg motion server controller_emulator tools

INSTALL := $(PY) -m pip --disable-pip-version-check install --no-input -c constraints.txt
REQUIREMENTS := Makefile pyproject.toml constraints.txt hatch_build.py

# Paths inside the environment are absolute, and the editable install goes through .dev: when the
# folder was moved, or .dev or the interpreter is gone, the stamps no longer tell the truth.
STALE := $(shell test -x $(PY) && test -e .dev/openpendant/simplemsg/__init__.py \
	&& test "$$(cat $(VENV)/demo.stamp 2>/dev/null)" = "$$(pwd -P)" || echo stale)

# Where this is set, each of the hundreds of processes that tests start would compile all that it
# imports anew, and each worker of pytest all tests.
unexport PYTHONDONTWRITEBYTECODE

.DEFAULT_GOAL := help
.NOTPARALLEL:
.DELETE_ON_ERROR:
FUZZ_SECONDS ?= 60

# A commit to compare with: of bench (none unless named) and of mutants (HEAD unless named).
BASE ?=

BENCH ?=
BENCH_ARGS ?=

MUTANTS ?=
MUTANTS_ARGS ?=

FIRMWARE := tools/pendants/keypad/firmware
FIRMWARE_TESTS := tests/tools/pendants/keypad/firmware tests/system/test_keypad_pendant.py
PAGE_BUILD := tools/pendants/web/build.py
PENDANT_ARGS ?=
KEYPAD_ARGS ?=

WALK ?=
WALK_ARGS ?=

.PHONY: help demo start pendant keypad test browser wheel conformance harness firmware firmware-test bench lint format soak mutants walk fuzz audit reference clean stale

## help     this list
help:
	@echo 'openpendant: a virtual teach pendant'
	@echo
	@sed -n 's/^## /  make /p' Makefile
	@echo
	@echo 'Options: ROBOT=abb_irb2400 (demo, start), PYTEST_ARGS="-k limits" (test), PYTHON=/path/to/python3 (first run)'

## demo     a pendant application moves an emulated robot; ROBOT=ur5 unless named
demo: $(VENV)/demo.stamp
	$(VENV)/bin/openpendant demo --robot '$(ROBOT)'

## start    an emulated robot, its server and a pendant in this terminal; ROBOT=ur5 unless named
start: $(VENV)/demo.stamp
	@$(VENV)/bin/openpendant start --robot '$(ROBOT)'

## pendant  the pendant as a page: an emulated robot, its server and the gateway; ROBOT=ur5 unless named
pendant: $(VENV)/web.stamp
	@$(PY) $(PAGE_BUILD) --fetch-node || true
	@$(PY) -m openpendant.tools.start_page --robot '$(ROBOT)' $(PENDANT_ARGS)

## keypad   the keypad pendant on screen, without a board: its bridge, an emulated robot and the server
keypad: $(VENV)/keypad.stamp
	@$(PY) -m openpendant.tools.start_keypad --robot '$(ROBOT)' $(KEYPAD_ARGS)

## test     the tests, in WORKERS=2 processes, and beside them lint and the types of the product
test: $(VENV)/dev.stamp
	$(PY) tests/run_lanes.py --workers $(WORKERS) \
		--beside '$(RULES)' --beside '$(FORMAT)' --beside '$(PRODUCT_TYPES)' -- $(PYTEST_ARGS)

## conformance  what `make test` leaves out of the conformance tests, and our dissector in tshark
conformance: $(VENV)/dev.stamp
	$(PY) -m pytest -m 'conformance and not soak' $(PYTEST_ARGS)

## harness  try what runs the tests: lanes, workers, planted faults
harness: $(VENV)/dev.stamp
	$(PY) -m pytest -m harness $(PYTEST_ARGS)

## firmware  compile the keypad's firmware, if avr-gcc is here; how to flash it: docs/keypad-hardware.md
firmware:
	@if command -v avr-gcc >/dev/null; then $(MAKE) --no-print-directory -C $(FIRMWARE); \
	else $(call say,no avr-gcc here$(comma) no firmware. On Debian and Ubuntu: apt install gcc-avr avr-libc); fi

## firmware-test  compile the keypad's firmware and try it in simavr, if both are here; the longest of its processes
firmware-test: $(VENV)/dev.stamp
	$(PY) -m pytest -m 'firmware and not soak' --workers=$(WORKERS) $(FIRMWARE_TESTS) $(PYTEST_ARGS)

## browser  build the page and run the tests in real browsers
browser: $(VENV)/browser.stamp
	$(PY) $(PAGE_BUILD) --fetch-node --check
	$(PY) tests/run_browser_lanes.py $(PYTEST_ARGS)

## wheel    build the page, and with it the wheel and the source archive, into dist/
wheel: $(VENV)/dev.stamp
	$(PY) $(PAGE_BUILD) --fetch-node
	$(PY) -m hatchling build

## bench    medians and ratios of what must be fast; BASE=commit compares with that, BENCH=pattern chooses rows
bench: $(VENV)/demo.stamp
	$(PY) -m openpendant.tools.bench $(if $(BASE),--base '$(BASE)') $(BENCH_ARGS) $(if $(BENCH),--only '$(BENCH)')

## lint     ruff (rules and format) and mypy --strict, tests included
lint: $(VENV)/dev.stamp
	$(RULES)
	$(FORMAT)
	$(TYPES)

## format   let ruff put the files in order
format: $(VENV)/dev.stamp
	$(PY) -m ruff check --fix .
	$(PY) -m ruff format .

## soak     the long tests: thousands of random examples each, tests marked soak, and every promise
soak: $(VENV)/dev.stamp
	$(PY) tests/run_lanes.py --soak --workers $(WORKERS) -- $(PYTEST_ARGS)

## mutants  faults planted one by one, which tests must find; MUTANTS=changed, or a name or file
mutants: $(VENV)/dev.stamp
	$(PY) tests/mutants/run.py --workers $(WORKERS) --base '$(or $(BASE),HEAD)' $(MUTANTS_ARGS) '$(MUTANTS)'

## walk     what each event costs on its way through the server; WALK=a1 shows one file by file
walk: $(VENV)/dev.stamp
	$(PY) tests/walks/run.py $(WALK_ARGS) $(WALK)

## fuzz     atheris on decoder, connection, JSON bodies and capture loader, FUZZ_SECONDS=60 in all
fuzz: $(VENV)/fuzz.stamp
	$(PY) tests/fuzz/run.py --seconds $(FUZZ_SECONDS)

## audit    known vulnerabilities of the versions in constraints.txt, by pip-audit where a network is
audit: $(VENV)/demo.stamp
	$(PY) tests/known_vulnerabilities.py

## reference  write docs/protocol.md, docs/generated, docs/command-to-motion.md, the tables of promises.md, TypeScript and C
reference: $(VENV)/dev.stamp
	$(PY) -m openpendant.tools.reference
	$(PY) tests/promises/promise_page.py
	$(PY) tests/walks/motion_page.py

## clean    remove the environment and everything generated
clean:
	rm -rf tools/pendants/web/page tools/pendants/web/frontend/node_modules $(FIRMWARE)/build
	rm -rf $(VENV) .dev build dist demo-output .mypy_cache .pytest_cache .ruff_cache .hypothesis .coverage
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

stale:

$(VENV)/demo.stamp: $(REQUIREMENTS) $(STALE)
	$(call install,server$(comma)plot$(comma)terminal)
	@pwd -P > $@

$(VENV)/dev.stamp: $(REQUIREMENTS) $(STALE)
	$(call install,server$(comma)plot$(comma)terminal$(comma)dev)
	@pwd -P > $(VENV)/demo.stamp
	@pwd -P > $@

# The gateway on top of what the demo needs.
$(VENV)/web.stamp: $(VENV)/demo.stamp
	$(call install,server$(comma)plot$(comma)terminal$(comma)web)
	@touch $@

# The serial line on top of what the demo needs.
$(VENV)/keypad.stamp: $(VENV)/demo.stamp
	$(call install,server$(comma)plot$(comma)terminal$(comma)serial)
	@touch $@

# An extra of its own: atheris has wheels for Linux on x86-64 only, and nothing else needs it.
$(VENV)/fuzz.stamp: $(VENV)/dev.stamp
	$(call install,server$(comma)plot$(comma)terminal$(comma)dev$(comma)fuzz)
	@touch $@

# Node for those whose own is older than what runs TypeScript as it is: the tests of the generated
# TypeScript need it, and are skipped without.
$(VENV)/node.stamp: $(VENV)/dev.stamp
	$(call install,server$(comma)plot$(comma)terminal$(comma)dev$(comma)node)
	@touch $@

# What drives a real browser; the browser itself is the machine's.
$(VENV)/browser.stamp: $(VENV)/dev.stamp
	$(call install,server$(comma)plot$(comma)terminal$(comma)dev$(comma)browser)
	@touch $@

comma := ,
say = echo "openpendant: $(1)" >&2

# The build backend goes in first, under the same constraints, so that building needs no second,
# unpinned environment.
define install
	@command -v '$(PYTHON)' >/dev/null \
	|| { $(call say,no '$(PYTHON)' here. Install Python 3.11 or newer$(comma) or name one: make PYTHON=/path/to/python3); exit 1; }
	@'$(PYTHON)' -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
	|| { $(call say,'$(PYTHON)' is older than Python 3.11. Name a newer one: make PYTHON=/path/to/python3); exit 1; }
	@'$(PYTHON)' -c 'import ensurepip, venv' 2>/dev/null \
	|| { $(call say,'$(PYTHON)' has no venv module. Install it$(comma) on Debian and Ubuntu: apt install python3-venv); exit 1; }
	@$(PY) -m pip --version >/dev/null 2>&1 || '$(PYTHON)' -m venv --clear $(VENV)
	@{ $(INSTALL) hatchling && $(INSTALL) --no-build-isolation -e '.[$(1)]'; } \
	|| { $(call say,the installation failed$(comma) see above. What runs on which platform: README.md); exit 1; }
endef
