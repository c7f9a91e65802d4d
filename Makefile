# Start with `make demo` and `make test`; both install what they need into .venv. `make help` lists all targets.

VENV := .venv
BIN := $(VENV)/bin
PIP = $(BIN)/python -m pip install --quiet --no-compile
BYTE_CODE = $(BIN)/python -m compileall -qq -j 0
COLCON := .colcon

# The first suitable Python: 3.11 to 3.13 (there are no ROS 2 Jazzy wheels for later versions), with venv and pip.
FITS := import sys, venv, ensurepip; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 13))
PYTHON ?= $(firstword $(foreach p,python3 python3.13 python3.12 python3.11,$(shell $(p) -c '$(FITS)' >/dev/null 2>&1 && echo $(p))))

.PHONY: help venv demo demo-ros docs test test-long test-all .byte-code guards campaign campaign-bodies engines-blocks never-below never-green never-green-live never-green-guards faults combinations recovery lint bench bench-ros soak accuracy effects validation colcon clean
help:
	@echo "make demo                fly 200 rocks in a synthetic pit; results in out/demo"
	@echo "make demo-ros            play five minutes of a working shift with ROS 2 nodes, in half a minute; recording in out/demo-ros"
	@echo "make test                tests of every part; some minutes"
	@echo "make test-long           the tests that make test leaves out"
	@echo "make test-all            all tests; half an hour"
	@echo "make lint                ruff, mypy on the core, spelling, and words that the texts of rpf3d avoid (test/support/suite/habits.txt)"
	@echo "make docs                the documentation as a website, with a reference of all functions; in out/docs"
	@echo "make guards              remove each guard of the hard cases in a copy of the code, and check that its test fails"
	@echo "make campaign            4,000 examples of each property; 850 damaged files and 10,000 damaged messages of each kind; an hour or more"
	@echo "make campaign-bodies     3,000 rocks with a shape on random meshes: none may pass through the ground or gain energy; some minutes"
	@echo "make engines-blocks      1,000 blocks of Authume P1 on both engines, compared bit by bit; half an hour; needs the data of Authume"
	@echo "make never-below         1.25 million rocks on vertices, edges and facets of random meshes: none may fall through; some minutes"
	@echo "make never-green         2,000 combinations of defects of inputs: no alert may be too low; half an hour"
	@echo "make never-green-live    300 of these combinations with real processes"
	@echo "make never-green-guards  remove each guard of the alerts in a copy of the code, and check that a combination finds it"
	@echo "make faults              send a running simulator 10,000 damaged messages, then 1,000 messages a second for a minute; some minutes"
	@echo "make combinations        all combinations of effects on both engines, compared bit by bit; half an hour"
	@echo "make recovery            100 small calibrations: how often do 90 % intervals contain the known true values? ten minutes"
	@echo "make bench               measure the speed on this machine; about ten minutes"
	@echo "make bench-ros           measure how fast the live nodes answer, over DDS; about ten minutes on an idle machine"
	@echo "make soak                twenty minutes with rocks, new terrain, killed nodes and clock jumps; prints a report"
	@echo "make accuracy            measure the cost of accuracy, and write docs/explanation/accuracy.md; about four minutes"
	@echo "make effects             measure the cost of each model and effect, and write docs/reference/effects.md; some minutes"
	@echo "make validation          calibrate on field data, and write docs/explanation/validation.md; an hour; needs the field data"
	@echo "make colcon              build and test as a package of a ROS 2 workspace; some minutes"
	@echo "make venv                make only the virtual environment, with all extras"
	@echo "make clean               delete .venv, .colcon, out and all other generated folders"

venv: $(VENV)/.everything

# Two steps, because the demo needs neither ROS 2 nor the test tools, and their download takes longest. Only the second step
# compiles all byte code in advance: the demo needs little of it, but the tests start hundreds of processes.
$(VENV)/.core: setup.py
	@test -n "$(PYTHON)" || { echo "rpf3d needs Python 3.11, 3.12 or 3.13 with venv and pip (on Debian and Ubuntu:" \
	  "apt install python3-venv); none was found. Name one with: make venv PYTHON=/path/to/python3.11"; exit 1; }
	$(PYTHON) -m venv $(VENV)
	$(PIP) --editable .
	-@$(BIN)/rerun analytics disable >/dev/null 2>&1
	@touch $@

$(VENV)/.everything: $(VENV)/.core
	$(PIP) --editable '.[ros,mine,report,desk,test]'
	-@$(BYTE_CODE) $(VENV)/lib
	@touch $@

# Needs neither ROS 2 nor an import of the code, because the reference of functions is made from the source text.
$(VENV)/.docs: $(VENV)/.core
	$(PIP) --editable '.[docs]'
	@touch $@

docs: $(VENV)/.docs
	$(BIN)/python docs/gallery.py
	$(BIN)/python -m sphinx -W --keep-going -q -j auto -c docs/website . out/docs
	@echo "open out/docs/index.html"

demo: $(VENV)/.core
	$(BIN)/rpf3d run config/scenes/demo.yaml --out out/demo

demo-ros: venv
	$(BIN)/python -m rpf3d_ros.demo

# One worker more than cores, because the tests of live nodes mostly wait. Processes that tests start write no byte code
# (test/conftest.py), so .byte-code compiles it in advance. Byte code is valid for the hash of its source, not for the time
# of the file, because two edits may have the same time. The byte code of the tests is always written: this saves 10 s per
# worker. The files that take longest come first (test/support/suite/longest_first.py).
PYTEST = PYTHONDONTWRITEBYTECODE= $(BIN)/python -m pytest --dist loadfile --no-loadscope-reorder -n $$($(BIN)/python -c 'import os; print(len(os.sched_getaffinity(0)) + 1)')

.byte-code: venv
	@$(BYTE_CODE) --invalidation-mode checked-hash rpf3d_core rpf3d_ros

# The tests without the mark `long`, which also the tests have that two files in test/support/suite list: long_tests.txt and
# lone_loops.txt. Some tests of every file run.
test: .byte-code
	$(PYTEST) -m "not long"

test-long: .byte-code
	$(PYTEST) -m long

test-all: .byte-code
	$(PYTEST)

guards: venv
	$(BIN)/python test/hard/guards.py

# 40 properties, 11 of them of alerts; 28 kinds of files, four of them (VTK formats) with a tenth of the files; 12 types of
# messages. Report: test/properties/README.md.
campaign: venv
	RPF3D_EXAMPLES=4000 $(BIN)/python -m pytest -n auto test/properties --hypothesis-seed=20261121
	RPF3D_MUTATIONS=850 $(BIN)/python -m pytest -n auto test/formats/test_mutated_files.py
	RPF3D_MUTATIONS=10000 $(BIN)/python -m pytest -n auto test/ros/messages/test_damaged_messages.py

# `-m` finds the programs of these campaigns in test/support.
never-below never-green never-green-live never-green-guards campaign-bodies engines-blocks recovery: export PYTHONPATH := test/support:.

# Report: docs/explanation/never-below.md.
never-below: venv
	$(BIN)/python -m campaigns.never_below --rebound constant --rebound coulomb_limited

# Report of these three: docs/explanation/never-green.md.
never-green: venv
	$(BIN)/python -m never_green.campaign --count 2000

never-green-live: venv
	$(BIN)/python -m never_green.live --count 300

never-green-guards: venv
	$(BIN)/python -m never_green.guards

# Report: docs/explanation/never-below.md.
campaign-bodies: venv
	$(BIN)/python -m campaigns.bodies_on_meshes --bodies 3000 --each 6 --first 901

# Report: docs/explanation/bodies.md.
engines-blocks: venv
	$(BIN)/python -m campaigns.blocks_on_both_engines config/scenes/authume_p1_blocks.yaml --blocks 1000

# The long tests of test/ros/faults with a running simulator: 1,250 damaged messages on each of eight topics, and a flood of
# messages for one minute.
faults: venv
	RPF3D_MUTATIONS=1250 $(BIN)/python -m pytest test/ros/faults/test_damaged.py
	RPF3D_FLOOD=60 $(BIN)/python -m pytest test/ros/faults/test_flood.py

# 128 combinations of effects, each compiled and flown on both engines. Eight processes one after the other, because the
# memory of a process grows with each combination that it compiles.
combinations: venv
	for part in 0 1 2 3 4 5 6 7; do \
	  RPF3D_COMBINATIONS=$$part/8 $(BIN)/python -m pytest -q -n auto test/parity/test_effects_together.py || exit 1; done

lint: venv
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/codespell
	$(BIN)/python test/support/suite/habits.py

# Fails unless 85 to 95 of 100 intervals contain the true value. Report: docs/reference/calibration.md.
recovery: venv
	$(BIN)/python -m campaigns.recovery --count 100

bench: venv
	$(BIN)/python benchmarks/large_mesh.py
	$(BIN)/python benchmarks/flight.py
	$(BIN)/python benchmarks/blocks.py
	$(BIN)/python benchmarks/blocks_in_cpp.py
	$(BIN)/python benchmarks/ensemble.py
	$(BIN)/python benchmarks/live_ground.py

bench-ros: venv
	$(BIN)/python benchmarks/live.py

soak: venv
	@mkdir -p out
	$(BIN)/python benchmarks/soak.py --json out/soak.json

accuracy: venv
	$(BIN)/python docs/accuracy.py

effects: venv
	$(BIN)/python docs/effects.py

validation: venv
	$(BIN)/python docs/validation.py

$(COLCON)/.installed:
	@test -n "$(PYTHON)" || { echo "make colcon needs Python 3.11, 3.12 or 3.13 with venv and pip"; exit 1; }
	$(PYTHON) -m venv $(COLCON)
	$(COLCON)/bin/python -m pip install --quiet --no-compile colcon-common-extensions catkin_pkg 'setuptools<80'
	@touch $@

# `make colcon` only tests that the nodes start and answer. `make test` tests everything else.
COLCON_TESTS := test/project/test_package.py test/ros/interface/test_parameters.py \
  $(foreach subject,launch_files lifecycle simulator_node,test/ros/nodes/test_$(subject).py)

# The workspace is a temporary folder, which is deleted at the end. The tests use the libraries of the virtual environment; its
# Python knows the folder of the shared libraries of the ROS 2 wheels.
colcon: $(COLCON)/.installed venv
	@set -eu; work=$$(mktemp -d); trap 'rm -rf "$$work"' EXIT; export PATH="$(CURDIR)/$(COLCON)/bin:$$PATH" COLCON_LOG_PATH="$$work/log"; \
	mkdir -p "$$work/src/rpf3d"; \
	cp -r package.xml setup.py setup.cfg pyproject.toml LICENSE README.md CHANGELOG.rst resource config launch rpf3d_core rpf3d_ros test "$$work/src/rpf3d"; \
	cd "$$work"; colcon list; \
	colcon list | grep -q 'ros.ament_python' || { echo "colcon does not see an ament_python package: check package.xml"; exit 1; }; \
	colcon build; \
	for made in lib/rpf3d/rpf3d_simulator lib/rpf3d/rpf3d_recorder lib/rpf3d/rpf3d_scene_publisher \
	  lib/rpf3d/rpf3d_play_bag lib/rpf3d/rpf3d_acknowledge share/rpf3d/package.xml \
	  share/ament_index/resource_index/packages/rpf3d; do \
	  test -e "install/rpf3d/$$made" || { echo "colcon build did not install $$made"; exit 1; }; done; \
	export PYTHONPATH="$$($(CURDIR)/$(BIN)/python -c 'import sysconfig; print(sysconfig.get_path("purelib"))')"; \
	export LD_LIBRARY_PATH="$$($(CURDIR)/$(BIN)/python -c 'import os; print(os.environ.get("LD_LIBRARY_PATH", ""))')"; \
	colcon test --return-code-on-test-failure --event-handlers console_cohesion+ \
	  --pytest-args $(COLCON_TESTS); \
	colcon test-result --all; \
	echo "colcon: built, installed and tested as ros.ament_python"

clean:
	rm -rf $(VENV) $(COLCON) build install log out docs/api *.egg-info .mypy_cache .pytest_cache .ruff_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
