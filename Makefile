# rpf3d. `make demo` and `make test` are all that a newcomer needs; both fill .venv on their first run.

VENV := .venv
BIN := $(VENV)/bin
PIP = $(BIN)/python -m pip install --quiet --no-compile
BYTE_CODE = $(BIN)/python -m compileall -qq -j 0
COLCON := .colcon

# The first Python that can carry everything: 3.11 to 3.13 (there are no ROS 2 Jazzy wheels beyond), with venv and pip.
FITS := import sys, venv, ensurepip; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 13))
PYTHON ?= $(firstword $(foreach p,python3 python3.13 python3.12 python3.11,$(shell $(p) -c '$(FITS)' >/dev/null 2>&1 && echo $(p))))

.PHONY: help venv demo demo-ros docs test test-long test-all .byte-code guards campaign campaign-bodies engines-blocks never-below never-green never-green-live never-green-guards faults combinations recovery lint bench bench-ros soak accuracy effects validation colcon clean
help:
	@echo "make demo      fly 200 rocks into a synthetic pit; results in out/demo"
	@echo "make demo-ros  five minutes of a shift through ROS 2 nodes, in time lapse; leaves a recording in out/demo-ros"
	@echo "make test      tests of every part; some minutes"
	@echo "make test-all  every test; half an hour. make test-long: those that make test leaves out"
	@echo "make docs      the documentation as a site, with a reference of all functions; in out/docs"
	@echo "make guards    take each guard of the hard cases away in a copy, and demand that its test fails"
	@echo "make campaign  100,000 examples of the properties, 10,000 damaged files and 10,000 damaged messages of each type; an hour"
	@echo "make never-below  1.25 million rocks on vertices, edges and faces of random meshes: none may fall through; some minutes"
	@echo "make never-green  2,000 combinations of harmed inputs: no alert may look too safe; half an hour. make never-green-live:"
	@echo "                 300 with real processes; make never-green-guards: take each guard away, and demand that it is found"
	@echo "make campaign-bodies  3,000 rocks with a shape over random meshes: none may pass through or gain energy; some minutes"
	@echo "make engines-blocks  1,000 blocks of Authume P1 on both engines, bit by bit; half an hour, and needs that data"
	@echo "make faults    10,000 damaged messages and a minute of 1,000 messages a second on a living simulator; some minutes"
	@echo "make combinations  every combination of effects on both engines, bit by bit; half an hour"
	@echo "make recovery  100 small calibrations with known answers: how often their 90 % intervals hold; ten minutes"
	@echo "make lint      ruff, mypy on the core, spelling, and words that our prose avoids (test/support/habits.txt)"
	@echo "make bench     how fast it is on this machine; takes about ten minutes"
	@echo "make bench-ros how fast the live nodes answer, over DDS; takes about ten minutes of an idle machine"
	@echo "make soak      twenty minutes of rocks, new ground, kills and jumps of the clock; prints a report"
	@echo "make accuracy  measure what accuracy costs, and write docs/explanation/accuracy.md; takes about four minutes"
	@echo "make effects   measure what each model and effect costs, and write docs/reference/effects.md; takes some minutes"
	@echo "make validation  calibrate on field data, and write docs/explanation/validation.md; takes an hour, and needs that data"
	@echo "make colcon    build and test as a ROS 2 workspace does; some minutes"
	@echo "make venv      only the virtual environment, with everything in it"
	@echo "make clean     remove what the others made"

venv: $(VENV)/.everything

# In two steps, because the demo needs neither ROS 2 nor the test tools, and they take longer to fetch than all the rest.
# Only the second compiles to byte code ahead of use: the demo needs little of it, the tests start hundreds of processes.
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

# Needs neither ROS 2 nor an import of the code: the reference of functions is read from the sources.
$(VENV)/.docs: $(VENV)/.core
	$(PIP) --editable '.[docs]'
	@touch $@

docs: $(VENV)/.docs
	$(BIN)/python docs/gallery.py
	$(BIN)/python -m sphinx -W --keep-going -q -c docs/website . out/docs
	@echo "open out/docs/index.html"

demo: $(VENV)/.core
	$(BIN)/rpf3d run config/scenes/demo.yaml --out out/demo

demo-ros: venv
	$(BIN)/python -m rpf3d_ros.demo

# A worker more than there are cores, for tests of live nodes mostly wait. Their children write no byte code
# (test/conftest.py), so it is laid down before; it goes by what the source holds, not by a time that edits may share.
# The byte code of the tests themselves is kept, whatever the environment says: 10 s a worker. The files that take longest
# come first (test/support/longest_first.py).
PYTEST = PYTHONDONTWRITEBYTECODE= $(BIN)/python -m pytest --dist loadfile --no-loadscope-reorder -n $$($(BIN)/python -c 'import os; print(len(os.sched_getaffinity(0)) + 1)')

.byte-code: venv
	@$(BYTE_CODE) --invalidation-mode checked-hash rpf3d_core rpf3d_ros

# The tests that are not marked `long`: some of every file (test/project/test_long_tests.py)
test: .byte-code
	$(PYTEST) -m "not long"

test-long: .byte-code
	$(PYTEST) -m long

test-all: .byte-code
	$(PYTEST)

guards: venv
	$(BIN)/python test/hard/guards.py

# 37 properties, ten of them of alerts; 16 kinds of files, four of them tried on a tenth; 6 kinds of messages. The report: test/properties/README.md
campaign: venv
	RPF3D_EXAMPLES=4000 $(BIN)/python -m pytest -n auto test/properties --hypothesis-seed=20261121
	RPF3D_MUTATIONS=850 $(BIN)/python -m pytest -n auto test/formats/test_mutated_files.py
	RPF3D_MUTATIONS=10000 $(BIN)/python -m pytest -n auto test/ros/messages/test_damaged_messages.py

# The report: docs/explanation/never-below.md
never-below: venv
	$(BIN)/python test/support/never_below.py --rebound constant --rebound coulomb_limited

# The report of these three: docs/explanation/never-green.md
never-green never-green-live never-green-guards: export PYTHONPATH := test/support:.
never-green: venv
	$(BIN)/python -m never_green.campaign --count 2000

never-green-live: venv
	$(BIN)/python -m never_green.live --count 300

never-green-guards: venv
	$(BIN)/python -m never_green.guards

# The report: docs/explanation/never-below.md
campaign-bodies: venv
	$(BIN)/python test/support/bodies_on_meshes.py --bodies 3000 --each 6 --first 901

# The report: docs/explanation/bodies.md
engines-blocks: venv
	$(BIN)/python test/support/blocks_on_both_engines.py config/scenes/authume_p1_blocks.yaml --blocks 1000

# The long ones of test/ros/faults on a living simulator, 10,000 damaged messages and a flood of a minute
faults: venv
	RPF3D_MUTATIONS=1250 $(BIN)/python -m pytest test/ros/faults/test_damaged.py
	RPF3D_FLOOD=60 $(BIN)/python -m pytest test/ros/faults/test_flood.py

# 128 combinations of the effects, each compiled and flown on both engines; in parts, for a process keeps what it compiles
combinations: venv
	for part in 0 1 2 3 4 5 6 7; do \
	  RPF3D_COMBINATIONS=$$part/8 $(BIN)/python -m pytest -q -n auto test/parity/test_effects_together.py || exit 1; done

lint: venv
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/codespell
	$(BIN)/python test/support/habits.py

# 100 small calibrations with known answers: how often do 90 % intervals hold the true values? Between 85 and 95 times
recovery: venv
	$(BIN)/python test/support/recovery.py --count 100

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

# What colcon tests here: that the nodes come up and answer. Everything else is `make test`.
COLCON_TESTS := test/project/test_package.py test/ros/interface/test_parameters.py \
  $(foreach subject,launch_files lifecycle simulator_node,test/ros/nodes/test_$(subject).py)

# The workspace is a temporary folder, so nothing of it stays behind. Its tests find the libraries in the virtual environment,
# whose Python knows where the wheels of ROS 2 have their shared ones.
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
