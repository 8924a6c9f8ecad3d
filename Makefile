# Two commands do all set-up on a machine with Python 3.11+ and make: `make demo` and `make test`.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
# A stamp a lock file: set-up is redone when, and only when, what it depends on has changed.
RUNTIME := $(VENV)/.runtime
DEVELOP := $(VENV)/.develop
RIVALS := $(VENV)/.rivals

# Some of every room, by file: those that simulate no voyage and compile little. `make quick` takes half a minute on two
# cores once numba has compiled what they call; what runs a ship from log to diagnosis is left to `make test`.
QUICK := test_layers.py test_docstrings.py package/test_import.py docs/test_documents.py docs/test_model.py \
	$(addprefix ingest/test_, cells.py delimited.py nmea.py cdr.py) channels segment/test_imo.py \
	$(addprefix model/test_, ship.py expression.py effects.py) $(addprefix estimate/test_, arrow.py record.py uncertainty.py) \
	predict/test_prediction.py manoeuvre/test_motion.py next_trial/test_worth.py shooting/test_ahead.py $(addprefix compare/test_, overshoot.py where.py) diagnose/test_formula.py \
	$(addprefix steering/test_, nomoto.py stability.py) $(addprefix history/test_, contrasts.py pooled.py) \
	$(addprefix simulate/test_, disturbances.py manoeuvre.py) $(addprefix warehouse/test_, store.py vessels.py segments.py) \
	flows/test_fleet_plan.py $(addprefix workbench/test_, names.py effects.py)

.PHONY: demo test check lint types compiled quick bench bench-long lock clean setup

demo: $(RUNTIME)
	$(BIN)/kempf demo
	@echo "  (first: source $(BIN)/activate)"

# First, beside the check of types, whether the demonstration still gives the reference's segments and parameter sets, bit
# for bit: it compiles what the tests call, which each of their processes would do for itself. Then the tests, in the order
# of their names: by default the files with the fewest tests come last, and these are the slowest.
test: lint
	$(MAKE) --jobs 2 types compiled
	$(BIN)/python -m pytest --numprocesses auto --dist loadfile --no-loadscope-reorder

compiled: $(DEVELOP)
	$(BIN)/python -m benchmarks.identify.identical demo

lint: $(DEVELOP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(DEVELOP)
	$(BIN)/mypy

check: lint types

quick: lint
	$(BIN)/python -m pytest --numprocesses 2 --dist loadfile $(addprefix tests/, $(QUICK))

# Every figure anew, each on its own page in benchmarks/results; needs the measured logs in ../shared. Minutes.
bench: $(RIVALS)
	for name in documents.house identify.engines identify.hsva identify.hsva_held_out identify.usv identify.trials fleet.rerun_demo ingest.speed \
		identify.monte_carlo identify.current_frame documents.draw_paper documents.draw_readme identify.course_keeping identify.estimator_speed \
		identify.estimators baselines.vessel_models diagnose.trials_diagnosis diagnose.trials_as_sold diagnose.hsva_ladder \
		diagnose.hsva_folds diagnose.pond_ladder diagnose.slow_rows diagnose.slow_readings diagnose.coarse_stamps diagnose.run_subsets diagnose.pond_bounds diagnose.noise_hills diagnose.diagnosis_speed identify.prediction identify.circles_in_wind identify.predicted_measured ingest.doctor_measured \
		ingest.mcap_speed ingest.nmea_speed ingest.nmea_clocks ingest.mcap_clocks fleet.adopt fleet.command_speed aims; \
		do $(BIN)/python -m benchmarks.$$name || exit 1; done

# The long ones, half an hour and more each on two cores; the last three need a Chromium.
bench-long: $(DEVELOP)
	for name in identify.captive_twin identify.information_limit identify.intervals_as_sold identify.changes identify.no_log identify.paper_map diagnose.hidden_effects diagnose.parted \
		diagnose.stretches identify.noisy_inputs identify.unsure_instants identify.updates ingest.doctor fleet.fleet fleet.history_speed fleet.kill fleet.kill_dask fleet.kill_torn fleet.flips fleet.one_log_more fleet.ten_nights \
		fleet.ten_thousand ingest.fuzz documents.draw_workbench pages.drawing pages.stories; \
		do $(BIN)/python -m benchmarks.$$name || exit 1; done

setup: $(DEVELOP)

# uv installs in seconds what pip takes minutes for; it comes from the lock file too.
$(VENV)/.uv: requirements/uv.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Kempf needs Python 3.11 or newer; set PYTHON=...")'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements/uv.txt
	touch $@

$(RUNTIME): $(VENV)/.uv requirements/runtime.txt pyproject.toml
	VIRTUAL_ENV=$(abspath $(VENV)) $(BIN)/uv pip install --quiet --require-hashes -r requirements/runtime.txt
	VIRTUAL_ENV=$(abspath $(VENV)) $(BIN)/uv pip install --quiet --no-deps --no-build-isolation --editable .
	touch $@

$(DEVELOP): $(RUNTIME) requirements/develop.txt
	VIRTUAL_ENV=$(abspath $(VENV)) $(BIN)/uv pip install --quiet --require-hashes -r requirements/develop.txt
	touch $@

# Only the benchmarks want these.
$(RIVALS): $(DEVELOP) requirements/rivals.txt
	VIRTUAL_ENV=$(abspath $(VENV)) $(BIN)/uv pip install --quiet --require-hashes -r requirements/rivals.txt
	touch $@

# The lock files hold for every Python from 3.11 on and for Linux, macOS and Windows.
lock: $(VENV)/.uv
	$(BIN)/uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-emit-index-url \
		--no-emit-find-links --no-header --group build pyproject.toml -o requirements/runtime.txt
	$(BIN)/uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-emit-index-url \
		--no-emit-find-links --no-header --group build --group dev pyproject.toml -c requirements/runtime.txt \
		-o requirements/develop.txt
	$(BIN)/uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-emit-index-url \
		--no-emit-find-links --no-header --group build --extra dask --extra lineage pyproject.toml -c requirements/develop.txt \
		-o requirements/deploy.txt
	$(BIN)/uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-emit-index-url \
		--no-emit-find-links --no-header --group build --group rivals pyproject.toml -c requirements/develop.txt \
		-o requirements/rivals.txt

clean:
	rm -rf $(VENV) kempf-demo *.egg-info
