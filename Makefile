# make help lists the targets.
SHELL := /bin/bash
.SHELLFLAGS := -o pipefail -c
.DEFAULT_GOAL := help
.PHONY: help env demo panel calibration-demo calm-demo pick-demo test test-no-nodes test-properties test-jazzy test-kilted test-processors wheel test-wheel coverage release-check lint docs soak bench clean

IN_ENV := source ./env.sh &&

# Tests that start nodes, at the same time: they wait for more than half of their time.
NODE_TESTS ?= 3
# More options of pytest for tests that start nodes.
NODE_OPTIONS ?=

# Each core has tests of its own: threads within one test would only take them turns.
test test-no-nodes test-properties soak coverage: export OPENBLAS_NUM_THREADS := 1

# Each run of pytest collects only what it runs.
FILES_WITH = grep -rlE "$(1)" test --include="test_*.py"

help: ## this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / {printf "  make %-15s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

env: ## everything that running and testing need (.venv, install/)
	@scripts/make_env.sh

demo: env ## drive a simulated tri-glide through real nodes; writes out/demo.png
	@$(IN_ENV) exec install/tri_glide_kinematics/lib/tri_glide_kinematics/demo --output out

calibration-demo: env ## probe, measure and calibrate a simulated machine that is wrong; writes out/calibration_demo.png
	@$(IN_ENV) exec install/tri_glide_kinematics/lib/tri_glide_kinematics/calibration_demo --output out

calm-demo: env ## drive a simulated machine that swings, without a shaper and with one; writes out/calm_demo.png
	@$(IN_ENV) exec install/tri_glide_kinematics/lib/tri_glide_kinematics/calm_demo --output out

pick-demo: env ## pick parts from a simulated belt that moves, and place them; writes out/pick_demo.png
	@$(IN_ENV) exec install/tri_glide_kinematics/lib/tri_glide_kinematics/pick_demo --output out

panel: env ## a simulated tri-glide, and the page in the browser that shows and drives it; Ctrl-C ends it
	@$(IN_ENV) mkdir -p out && exec install/tri_glide_kinematics/lib/tri_glide_kinematics/panel --points out/taught_points.yaml

test: test-no-nodes ## all tests: mathematics and motion on all cores, nodes as real processes, then what is timed
	@scripts/find_browser.sh >/dev/null || echo "test: no browser is installed: the panel's tests in a browser are left out"
	@$(IN_ENV) unset PYTHONDONTWRITEBYTECODE && python -m pytest -n $(NODE_TESTS) --dist loadfile --no-loadscope-reorder -m "nodes and not alone" $(NODE_OPTIONS) \
		test/integration $$($(call FILES_WITH,mark.nodes) | grep -v ^test/integration) \
		&& exec python -m pytest -m alone $(NODE_OPTIONS) $$($(call FILES_WITH,mark.alone))

test-no-nodes: env ## all tests that start no nodes
	@$(IN_ENV) unset PYTHONDONTWRITEBYTECODE && exec python -m pytest -n auto -m "not nodes and not alone" --ignore=test/integration

test-properties: env ## the laws that hold for all machines, and the public names: what other versions of libraries may break
	@$(IN_ENV) unset PYTHONDONTWRITEBYTECODE && exec python -m pytest -n auto -m "not nodes and not alone" $$(scripts/properties.sh)

test-jazzy: ## all tests with the versions of an Ubuntu 24.04 with Jazzy, in an environment of their own
	@scripts/test_distribution.sh jazzy test

test-kilted: ## all tests with the wheels of ROS 2 Kilted, in an environment of their own
	@scripts/test_distribution.sh kilted test

test-processors: env ## all tests without nodes, as they run on five kinds of processors
	@$(IN_ENV) exec scripts/test_processors.sh

wheel: env ## the package without ROS for pip, into out/; the same commit gives the same bytes
	@$(IN_ENV) exec scripts/build_wheel.sh

test-wheel: env ## the tests that need no ROS, with the wheel in environments without ROS, on each Python that is found
	@exec scripts/test_wheel.sh

coverage: env ## which lines of the package all tests run; takes somewhat longer than they do
	@$(IN_ENV) exec scripts/coverage.sh

release-check: env ## what a release into the ROS index asks for: rosdep and bloom on kept files, licences
	@scripts/release_check.sh

lint: env ## ruff, mypy, and which room imports which
	@$(IN_ENV) ruff check . && ruff format --check . && mypy && lint-imports

docs: env ## a site of all pages with search and reference, in out/docs; its links are checked
	@scripts/make_docs.sh

soak: env ## millions of steps, long tests at random, nodes that die, attacks on the page; SOAK_SEED names the seed
	@$(IN_ENV) export SOAK=10 SOAK_SEED=$${SOAK_SEED:-$$RANDOM} && echo "soak: SOAK_SEED=$$SOAK_SEED" \
		&& python -m pytest -n auto -m "(slow or hypothesis) and not nodes and not alone" --ignore=test/integration \
		&& python -m benchmarks.soak_motion --steps 5000000 --seed $$SOAK_SEED \
		&& python -m benchmarks.soak_bounds --steps 600000 --seed $$SOAK_SEED && python -m benchmarks.soak_pieces \
		&& python -m benchmarks.soak_stops --count 100000 --seed $$SOAK_SEED \
		&& python -m benchmarks.soak_picks --cycles 10000 --seed $$SOAK_SEED \
		&& python -m benchmarks.soak_follow --seed $$SOAK_SEED \
		&& python -m benchmarks.soak_controller --steps 1000000 --seed $$SOAK_SEED \
		&& python -m benchmarks.soak_paths --count 10000 --seed $$SOAK_SEED \
		&& python -m benchmarks.soak_goals --seed $$SOAK_SEED && python -m benchmarks.soak_ends \
		&& python -m benchmarks.soak_bytes && python -m benchmarks.soak_page --seed $$SOAK_SEED \
		&& exec python -m benchmarks.soak_nodes

bench: env ## ratios to references measured in the same run; see docs/performance.md
	@$(IN_ENV) pip install --quiet --disable-pip-version-check -r requirements-bench.txt -c constraints.txt \
		&& exec python -m benchmarks

clean: ## remove everything that the other targets made
	rm -rf .venv .jazzy .kilted .wheel build install log out .pytest_cache .hypothesis .mypy_cache .ruff_cache
