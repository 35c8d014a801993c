# Everything by one command. `make` alone says which there are.
SHELL := /bin/bash
.DEFAULT_GOAL := help

VENV := .venv
PYTHON := $(VENV)/bin/python

.PHONY: help
help:  ## say which commands there are
	@sed -n 's/^\([a-z-]*\):.*## /  make \1\t/p' $(MAKEFILE_LIST) | expand -t 18

.PHONY: dev
dev:  ## build the extension and the messages into the source tree (PYTHONPATH=. then runs it)
	cmake -S . -B build/dev -G Ninja -DFLATLAND_IN_TREE=ON -DFLATLAND_WERROR=ON -DPython_EXECUTABLE="$$PWD/$(PYTHON)" >build/dev.log || { cat build/dev.log; exit 1; }
	cmake --build build/dev
