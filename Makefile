# Everything from a fresh clone, given Python 3.10+ and Rust: each target sets up what it needs.
PYTHON ?= python3
BIN := .venv/bin
RUST_SOURCES := Cargo.toml Cargo.lock $(shell find rust -name '*.rs' -o -name Cargo.toml)

.PHONY: build train test test-rust test-python test-ray fuzz bench stress reproduce docs lint format venv constraints clean

build: .venv/.native

train: build
	$(BIN)/python -m training pipeline $(TRAIN)

test: test-rust test-python

test-rust:
	cargo test --quiet --package snake-core --package snake-bench --package snake-stress

test-python: build
	$(BIN)/python -m pytest $(PYTEST)

RAY_TESTS := $(addprefix tests/experiments/test_distributed_,ppo.py rllib.py tune.py) $(addprefix tests/package/test_, \
	checker.py vector_env.py vector_env_input.py reward.py threads.py single_env.py wrappers.py)

# Ray in an environment of its own: RLlib pins an earlier Gymnasium, with which the interface is tested too.
test-ray: build .venv-ray/.packages
	PYTHONPATH=$(CURDIR) .venv-ray/bin/python -m pytest $(RAY_TESTS) $(PYTEST)

# What the suite asks of fixed inputs, asked of fresh random ones.
fuzz: build
	SNAKE_ENV_FUZZ=search $(BIN)/python -m pytest tests/package/test_fuzz.py tests/package/test_native.py tests/package/test_buffers.py $(PYTEST)

bench: build .venv/.peers
	$(BIN)/python -m benchmarks $(BENCH)

# Every scenario at length, about twenty minutes on two cores; STRESS=--quick takes a minute.
stress:
	cargo run --quiet --release -p snake-stress -- $(STRESS)

reproduce: build
	$(BIN)/python -m snake_env reproduce $(REPRODUCE)

docs: build
	$(BIN)/python -m snake_env card --write docs/environments.md
	$(BIN)/python -m experiments.architecture --write

lint: build
	cargo fmt --all --check
	cargo clippy --quiet --workspace --all-targets -- -D warnings
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

format: venv
	cargo fmt --all
	$(BIN)/ruff check --fix-only .
	$(BIN)/ruff format .

venv: .venv/.packages

.venv/.packages: pyproject.toml constraints.txt
	test -x $(BIN)/python || $(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt uv
	$(BIN)/uv pip install --quiet --python $(BIN)/python --constraint constraints.txt \
		--requirement pyproject.toml --extra test maturin
	touch $@

# Peers to compare with; the bench does without those that cannot be installed.
.venv/.peers: .venv/.packages
	-$(BIN)/uv pip install --quiet --python $(BIN)/python --constraint constraints.txt \
		--requirement pyproject.toml --extra bench
	touch $@

.venv-ray/.packages: pyproject.toml constraints.txt .venv/.packages
	test -x .venv-ray/bin/python || $(PYTHON) -m venv .venv-ray
	grep -v '^gymnasium==' constraints.txt > .venv-ray/constraints.txt
	$(BIN)/uv pip install --quiet --python .venv-ray/bin/python --constraint .venv-ray/constraints.txt \
		--requirement pyproject.toml --extra test --extra rllib
	touch $@

# The extension is compiled in release mode into snake_env/; Python sources are used where they are.
.venv/.native: .venv/.packages $(RUST_SOURCES)
	PATH="$(CURDIR)/$(BIN):$$PATH" VIRTUAL_ENV="$(CURDIR)/.venv" $(BIN)/maturin develop --release --uv --quiet
	touch $@

# Pin the whole tree anew; torch pins its own CUDA libraries.
constraints: venv
	printf 'maturin\nuv\n' | $(BIN)/uv pip compile --quiet --upgrade --universal --python-version 3.10 \
		--extra test --extra bench --extra ray --no-annotate --no-header pyproject.toml - | grep -vE '^(nvidia-|cuda-|triton)' > constraints.new
	mv constraints.new constraints.txt

clean:
	rm -rf .venv .venv-ray target snake_env/_native*.so .pytest_cache .ruff_cache .mypy_cache
