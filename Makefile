# Everything by one command; `make` alone says which there are.
SHELL := /bin/bash
.DEFAULT_GOAL := help

VENV := .venv
PYTHON := $(VENV)/bin/python
CPP_FILES = $(shell find src/cpp $(wildcard bench) -name '*.h' -o -name '*.cpp')

.PHONY: help
help:  ## say which commands there are
	@sed -n 's/^\([a-z-]*\):.*## /  make \1\t/p' $(MAKEFILE_LIST) | expand -t 18

.PHONY: setup
setup:  ## install what is missing (Debian packages, .venv) and build; seconds when nothing changed
	@tools/setup.sh run

.PHONY: setup-dev
setup-dev:  ## the same, with what tests, linters and catkin need
	@tools/setup.sh dev

.PHONY: run
run: setup  ## run the simulator: make run [WORLD=world.yaml] [ARGS="show_viz:=false seed:=1"]
	@tools/run.sh "$(WORLD)" $(ARGS)

.PHONY: test
test: setup-dev  ## run all tests: make test [ARGS="-k laser"]
	@. ./setup.bash && pytest $(ARGS)

.PHONY: fuzz
fuzz: setup-dev  ## try thousands of random jams against the promises of the physics engine
	@. ./setup.bash && FLATLAND_FUZZ=1 pytest --timeout 0 tests/unit/physics/test_jammed_bodies.py $(ARGS)

.PHONY: lint
lint: setup-dev  ## check style, types, and the stubs of the extension against the binary
	$(VENV)/bin/ruff check
	$(VENV)/bin/ruff format --check
	$(VENV)/bin/mypy
	cd build && ../$(VENV)/bin/stubtest --allowlist ../tools/stubtest_allowlist.txt flatland._core
	clang-format --dry-run -Werror $(CPP_FILES)

.PHONY: format
format: setup-dev  ## bring Python and C++ sources into shape
	$(VENV)/bin/ruff check --fix-only --exit-zero
	$(VENV)/bin/ruff format
	clang-format -i $(CPP_FILES)

.PHONY: bench
bench: setup-dev  ## measure speed into build/bench.json, .png: make bench [BASELINE=earlier.json]
	@. ./setup.bash && python bench --json build/bench.json --plot build/bench.png \
	  $(if $(BASELINE),--baseline "$(BASELINE)") $(ARGS)

.PHONY: docs
docs: setup  ## check that every link and picture of README.md and docs/ leads somewhere
	@$(PYTHON) tools/check_links.py README.md docs

.PHONY: pictures
pictures: setup-dev  ## make the pictures of README.md and docs/ anew, on a virtual screen
	@. ./setup.bash && python tools/draw_pictures.py && python tools/show_pictures.py

.PHONY: dev
dev:  ## build the extension and the messages into the source tree (PYTHONPATH=. then runs it)
	@mkdir -p build
	@cmake --preset dev >build/dev.log || { cat build/dev.log; exit 1; }
	cmake --build build/dev

.PHONY: coverage
coverage: setup-dev  ## measure which lines the tests run, into build/coverage: make coverage [ARGS="tests/unit"]
	@cmake --preset coverage >build/coverage.log || { cat build/coverage.log; exit 1; }
	cmake --build build/coverage
	@. ./setup.bash && tools/coverage.sh $(or $(ARGS),tests/unit tests/conformance tests/examples tests/ros)

# address, undefined or thread; without one the first two together.
SANITIZER :=
sanitize_preset := sanitize$(addprefix -,$(SANITIZER))
libraries_ := libasan.so libubsan.so
libraries_address := libasan.so
libraries_undefined := libubsan.so
libraries_thread := libtsan.so

.PHONY: sanitize
sanitize: setup-dev  ## run the unit tests with sanitizers in the extension: make sanitize [SANITIZER=address|undefined|thread]
	@$(if $(filter-out address undefined thread,$(SANITIZER)),$(error SANITIZER must be address, undefined or thread))
	@cmake --preset $(sanitize_preset) >build/sanitize.log || { cat build/sanitize.log; exit 1; }
	cmake --build build/$(sanitize_preset)
	. ./setup.bash && \
	  LD_PRELOAD="$$(for library in $(libraries_$(SANITIZER)); do g++ -print-file-name=$$library; done | xargs)" \
	  ASAN_OPTIONS=detect_leaks=0:quarantine_size_mb=16 UBSAN_OPTIONS=print_stacktrace=1 \
	  TSAN_OPTIONS="suppressions=$$PWD/tools/tsan_suppressions.txt:exitcode=66" \
	  PYTHONPATH="$$PWD/build/$(sanitize_preset)/python:$$PYTHONPATH" \
	  $(if $(filter thread,$(SANITIZER)),setarch -R) \
	  pytest --capture=sys tests/unit $(if $(filter thread,$(SANITIZER)),-m threads) $(ARGS)

.PHONY: clean
clean:  ## remove all that was built, .venv too
	rm -rf $(VENV) build flatland/_core*.so flatland/msg flatland/srv
