# Everything on a fresh machine: Python 3.11 or newer and make are enough.
#   make test   lint, types, import contracts, wheel, tests, coverage
#   make demo   an RRC on a pty, driven by the host client; CANopen: a potentiometer turns a motor;
#               two PICs as RT components, one loses its power
#   make docs   the site, of the pages in docs/ and the docstrings
PYTHON ?= $(shell command -v python3.11 || command -v python3.12 || command -v python3.13 || command -v python3)
VENV   ?= .venv
READY  := $(VENV)/.ready

.PHONY: test demo docs bench clean

test: $(READY)
	PATH="$(abspath $(VENV))/bin:$$PATH" tools/check

demo: $(READY)
	$(VENV)/bin/tickrig demo rrc
	@echo
	$(VENV)/bin/tickrig demo fig120
	@echo
	$(VENV)/bin/tickrig demo rtc-lite

docs: $(READY)
	$(VENV)/bin/sphinx-build -W --keep-going -q docs build/docs
	@echo build/docs/index.html

bench: $(READY)
	$(VENV)/bin/python tools/bench

$(READY): pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	    { echo "tickrig needs Python 3.11 or newer; $(PYTHON) is older. Try: make PYTHON=python3.12"; exit 2; }
	$(PYTHON) -m venv $(VENV)
	$(VENV)/bin/python -m pip install --quiet --upgrade pip
	$(VENV)/bin/python -m pip install --quiet --editable '.[tui,plot,fast,dbc,rtc,openrtm,ros2,docs]' --group dev
	@touch $(READY)

clean:
	rm -rf $(VENV) build dist src/*.egg-info .coverage .hypothesis .mypy_cache .pytest_cache .ruff_cache
