# isocoat: `make` builds, `make demo` shows, `make test` checks everything. `make help` lists the rest.
# Needs GNU make, cargo and a C compiler; what else a target needs, `make deps` fetches.

.DEFAULT_GOAL := build
.DELETE_ON_ERROR:
.SUFFIXES:
MAKEFLAGS += --no-builtin-rules --no-print-directory

CARGO      ?= cargo
PKG_CONFIG ?= pkg-config
ifeq ($(origin CC),default)
CC := cc
endif
ifeq ($(origin CXX),default)
CXX := c++
endif

PREFIX     ?= /usr/local
LIBDIR     ?= lib
INCLUDEDIR ?= include
DESTDIR    ?=

# The only place that says the version is Cargo.toml.
VERSION := $(shell sed -n '/^\[package\]/,/^\[[^p]/s/^version *= *"\(.*\)"/\1/p' Cargo.toml)

# What a static Rust library needs from a Linux system; tests/install compares it with what rustc says.
STATIC_LIBS ?= -lgcc_s -lutil -lrt -lpthread -lm -ldl -lc

TARGET    := $(abspath $(or $(CARGO_TARGET_DIR),target))
WORK      := $(TARGET)/make
STAGE     := $(WORK)/stage
OUT       := out
STATICLIB := $(TARGET)/release/libisocoat.a
SHAREDLIB := $(TARGET)/release/libisocoat.$(if $(filter Darwin,$(shell uname -s)),dylib,so)
HEADERS   := $(wildcard include/isocoat/* bindings/*/*.hpp tests/c/*.h tests/cpp/*.h tests/cpp/*.hpp \
               examples/common/*.h examples/cpp/*.hpp)

WARNINGS     := -Wall -Wextra -Wpedantic -Wshadow -Werror
C_FLAGS      := -std=c11 -O2 -g $(WARNINGS) -Wstrict-prototypes -Iinclude
CXX_FLAGS    := -std=c++17 -O2 -g $(WARNINGS) -Iinclude -Ibindings/bullet
ASAN_FLAGS   := -O1 -fno-omit-frame-pointer -fsanitize=address,undefined -fno-sanitize-recover=all
BULLET_CFLAGS = $(shell $(PKG_CONFIG) --cflags $(1) | sed 's/-I/-isystem /g')
BULLET_LIBS   = $(shell $(PKG_CONFIG) --libs $(1))

# Programs are found, not listed: every file with a main.
programs = $(if $(wildcard $(1)),$(shell grep -lE '^int main\>' $(wildcard $(1))))
named    = $(foreach file,$(1),$(2)/$(basename $(notdir $(file)))$(3))

C_TESTS      := $(call programs,tests/c/*.c)
CPP_TESTS    := $(call programs,tests/cpp/*.cpp)
C_EXAMPLES   := $(call programs,examples/c/*.c)
CPP_EXAMPLES := $(call programs,examples/cpp/*.cpp)
CMOCKA        = $(if $(shell grep -ls cmocka.h $(C_TESTS) /dev/null),$(shell $(PKG_CONFIG) --cflags --libs cmocka))

# ---- build -----------------------------------------------------------------------------------------------------------

.PHONY: build
build: ## build the shared and the static library (release)
	$(CARGO) build --release

.PHONY: stage
stage: build
	@PREFIX='$(STAGE)' DESTDIR= LIBDIR=lib INCLUDEDIR=include $(INSTALL)

# Cargo decides what is out of date; programs are linked again only when it made a new archive.
$(STATICLIB): build
	@:

define compile_each # sources, folder, suffix, compiler line, libraries
$(foreach file,$(1),$(eval $(call compile_one,$(file),$(call named,$(file),$(2),$(3)),$(4),$(5))))
endef
define compile_one
$(2): $(1) $(HEADERS) $(STATICLIB) Makefile
	@mkdir -p $$(@D)
	$(3) $(1) -o $$@ $(STATICLIB) $(4) $(STATIC_LIBS)
endef

c_line      = $$(CC) $$(C_FLAGS) $(1) $$(CFLAGS)
bullet_line = $$(CXX) $$(CXX_FLAGS) $$(CXXFLAGS) $$(call BULLET_CFLAGS,$(1))
bullet_libs = $$(call BULLET_LIBS,$(1))

$(call compile_each,$(C_TESTS),$(WORK)/tests/c,,$(call c_line),$$(CMOCKA))
$(call compile_each,$(C_TESTS),$(WORK)/tests/c,-asan,$(call c_line,$$(ASAN_FLAGS)),$$(CMOCKA))
$(call compile_each,$(CPP_TESTS),$(WORK)/tests/cpp,-float,$(call bullet_line,bullet),$(call bullet_libs,bullet))
$(call compile_each,$(CPP_TESTS),$(WORK)/tests/cpp,-double,$\
	$(call bullet_line,bullet-float64),$(call bullet_libs,bullet-float64))
$(call compile_each,$(C_EXAMPLES),$(WORK)/examples,,$(call c_line))
$(call compile_each,$(CPP_EXAMPLES),$(WORK)/examples/cpp,,$(call bullet_line,bullet),$(call bullet_libs,bullet))

C_TEST_BINS      := $(call named,$(C_TESTS),$(WORK)/tests/c)
C_TEST_BINS_ASAN := $(addsuffix -asan,$(C_TEST_BINS))
BULLET_BINS      := $(foreach kind,float double,$(call named,$(CPP_TESTS),$(WORK)/tests/cpp,-$(kind)))
EXAMPLE_BINS     := $(call named,$(C_EXAMPLES),$(WORK)/examples) $(call named,$(CPP_EXAMPLES),$(WORK)/examples/cpp)

# ---- demo ------------------------------------------------------------------------------------------------------------

.PHONY: demo
demo: ## build, drop two balls from C and a pile with Bullet, plot height and force into out/
	@tools/deps.sh demo
	@$(MAKE) demo-c demo-bullet demo-plot

.PHONY: demo-c demo-bullet demo-plot
demo-c: $(WORK)/examples/two_balls
	@printf '\n== Two balls, from C (examples/c/two_balls.c)\n'
	@$<

demo-bullet:
	@printf '\n== A pile, with Bullet (examples/cpp/bullet_drop.cpp)\n'
	@if command -v $(CXX) >/dev/null && $(PKG_CONFIG) --exists bullet 2>/dev/null; then \
		$(MAKE) $(WORK)/examples/cpp/bullet_drop && $(WORK)/examples/cpp/bullet_drop; \
	else \
		echo 'Skipped: Bullet (libbullet-dev), a C++ compiler or pkg-config is missing, and could not be installed.'; \
	fi

demo-plot:
	@printf '\n== The two balls again, from Rust, as a plot (examples/rust/two_balls_plot.rs)\n'
	@mkdir -p $(OUT)
	$(CARGO) run --release --quiet --example two_balls_plot -- $(OUT)/two_balls.svg

SCENES := collision clover muscle jelly dough skin sleeve fit cpp/bowl cpp/walk cpp/bullet_character

.PHONY: scenes
scenes: $(SCENES:%=$(WORK)/examples/%) ## characters, muscles, jelly: run each scene, with pictures in out/
	@for scene in $(SCENES); do \
		printf '\n== %s\n' $$scene; mkdir -p $(OUT)/$${scene##*/} && $(WORK)/examples/$$scene $(OUT)/$${scene##*/} || exit 1; \
	done

VIEWER := $(TARGET)/viewer/release/isocoat-view

# Cargo decides what is out of date.
.PHONY: viewer
viewer: ## build what makes pictures, PLY, OBJ and glTF of recordings
	$(CARGO) build --release --manifest-path tools/viewer/Cargo.toml --target-dir '$(TARGET)/viewer'

.PHONY: gallery
gallery: viewer $(SCENES:%=$(WORK)/examples/%) ## record the scenes, and show them in docs/gallery (takes minutes)
	@tools/gallery.sh '$(WORK)/examples' '$(VIEWER)' '$(WORK)/recordings' docs/gallery

# ---- test ------------------------------------------------------------------------------------------------------------

# In this order; the first that fails stops the run. Each is also a target: `make test-valgrind`. What cargo runs comes
# first, then what is linked to the libraries.
STAGES := format clippy rust header doc plot build symbols c valgrind asan bullet examples install viewer

.PHONY: test check
test: ## run every check, with a summary and times
	@tools/deps.sh test
	@LOGS='$(WORK)/logs' tools/stages.sh '$(MAKE)' $(STAGES)

check: test ## what CI runs: the same as test

.PHONY: $(STAGES:%=test-%)
test-format:
	$(CARGO) fmt --check

test-clippy:
	$(CARGO) clippy --release --all-targets -- -D warnings

test-plot: demo-plot

test-build: build

test-rust:
	$(CARGO) test --release

# Private items too: who reads the sources follows the same links.
test-doc:
	RUSTDOCFLAGS='-D warnings -A rustdoc::private_intra_doc_links' \
		$(CARGO) doc --release --no-deps --document-private-items

# The checked-in header is what the sources say (regenerate with `make header`).
test-header:
	$(CARGO) test --release --test header

.PHONY: header
header: ## regenerate include/isocoat/isocoat.h from the sources
	ISOCOAT_UPDATE_HEADER=1 $(CARGO) test --release --test header

test-symbols: build
	@tools/symbols.sh '$(SHAREDLIB)' '$(STATICLIB)' check

.PHONY: symbols
symbols: build ## accept today's exported functions as tests/abi/symbols.txt
	@tools/symbols.sh '$(SHAREDLIB)' '$(STATICLIB)' update

run_each = @tools/run_each.sh '$(2)' $(1)

test-c: $(C_TEST_BINS)
	$(call run_each,$(C_TEST_BINS),)

test-valgrind: $(C_TEST_BINS)
	$(call run_each,$(C_TEST_BINS),valgrind --quiet --error-exitcode=99 --leak-check=full \
		--errors-for-leak-kinds=definite$(comma)indirect$(comma)possible)

# The C side is instrumented by the C compiler, and every allocation of the Rust side goes through the sanitizer's
# malloc: overruns of host buffers, use after free at the boundary and leaks on either side are all seen.
test-asan: $(C_TEST_BINS_ASAN)
	$(call run_each,$(C_TEST_BINS_ASAN),env ASAN_OPTIONS=detect_leaks=1)

test-bullet: $(BULLET_BINS)
	$(call run_each,$(BULLET_BINS),)
	@CXX='$(CXX)' PKG_CONFIG='$(PKG_CONFIG)' STATIC_LIBS='$(STATIC_LIBS)' \
		tests/cpp/precision_mismatch.sh '$(STATICLIB)' '$(WORK)/precision'

test-examples: $(EXAMPLE_BINS)
	$(call run_each,$(EXAMPLE_BINS),)

test-install: build
	@CC='$(CC)' CXX='$(CXX)' PKG_CONFIG='$(PKG_CONFIG)' STATIC_LIBS='$(STATIC_LIBS)' VERSION='$(VERSION)' \
		TARGET='$(TARGET)' WORK='$(WORK)/install-test' MAKE='$(MAKE)' tests/install/run.sh

test-viewer:
	cd tools/viewer && $(CARGO) fmt --check && \
		$(CARGO) clippy --release --all-targets --target-dir '$(TARGET)/viewer' -- -D warnings && \
		$(CARGO) test --release --target-dir '$(TARGET)/viewer'

comma := ,

.PHONY: extremes
extremes: ## all rows of the stability tables, into docs/extremes.md (takes minutes)
	$(CARGO) test --release --test extremes -- --ignored --nocapture
	@if $(PKG_CONFIG) --exists bullet-float64 2>/dev/null; then \
		$(MAKE) $(WORK)/tests/cpp/bullet_extremes-double && \
		$(WORK)/tests/cpp/bullet_extremes-double table | tee -a docs/extremes.md; \
	else \
		echo 'No rows under Bullet: libbullet-dev is missing.'; \
	fi

.PHONY: loaf
loaf: ## a loaf of a thousand particles on a wedge, its halves pushed together again (takes a minute)
	$(CARGO) test --release --test substance -- --ignored --nocapture

.PHONY: count
count: ## what a scene pays for what it uses: bytes a body, instructions a step (needs valgrind)
	$(CARGO) test --release --test count -- --ignored --nocapture

.PHONY: workers
workers: ## how much faster two workers are (needs two idle cores)
	$(CARGO) test --release --test workers -- --ignored --nocapture

.PHONY: recording
recording: ## ten seconds of a loaf of a thousand particles: bytes and times of its recording (takes minutes)
	$(CARGO) test --release --test recording -- --ignored --nocapture

.PHONY: trade
trade: ## exactness against time over all that can be set, into docs/trade.md, CSV and SVG (takes minutes)
	$(CARGO) test --release --test trade -- --ignored --nocapture

# Peers are no part of the tests: what is missing is fetched if it can be, and said in the page if it cannot.
PEERS        := $(WORK)/peers
PEERS_PYTHON := $(TARGET)/peers/venv/bin/python

$(eval $(call compile_one,tools/peers/bullet_clusters.cpp,$(PEERS)/bullet_clusters,$\
	$(call bullet_line,bullet),$(call bullet_libs,bullet)))
$(eval $(call compile_one,tools/peers/coat_spheres.cpp,$(PEERS)/coat_spheres,$$(CXX) $$(CXX_FLAGS) $$(CXXFLAGS)))

.PHONY: peers
peers: ## isocoat beside Bullet's soft bodies, Drake's hydroelastic contact and splashsurf, into docs/peers.md (takes minutes)
	@command -v python3 >/dev/null || { echo 'python3 is missing: it runs the peers and writes the page.'; exit 1; }
	@tools/deps.sh demo
	@rm -f '$(PEERS)'/*
	-@$(MAKE) $(PEERS)/bullet_clusters
	-@$(MAKE) $(PEERS)/coat_spheres
	-@cd tools/peers/splashsurf && $(CARGO) build --release --quiet --target-dir '$(TARGET)/peers/splashsurf' && \
		cp '$(TARGET)/peers/splashsurf/release/mesh-particles' '$(PEERS)/'
	-@'$(PEERS_PYTHON)' -c 'import pydrake' 2>/dev/null || { echo 'Installing: drake, with pip, under target/'; \
		python3 -m venv '$(TARGET)/peers/venv' && '$(PEERS_PYTHON)' -m pip install --quiet drake; }
	@python3 tools/peers/run.py '$(PEERS)' '$(PEERS_PYTHON)'

# The bunny is no part of the repository.
BUNNY := $(WORK)/fit/bunny.obj

$(WORK)/fit/bunny.obj:
	@tools/bunny.sh '$@'

.PHONY: fit
fit: $(BUNNY) $(WORK)/examples/fit viewer ## coats fitted to a bunny, beside a lattice of balls, and a picture in out/ (fetches it)
	@ISOCOAT_FIT_MESH='$(BUNNY)' $(CARGO) test --release --quiet --test fit -- --ignored --nocapture
	@mkdir -p $(OUT)/fit
	@'$(WORK)/examples/fit' '$(BUNNY)' --record '$(WORK)/fit/bunny.reel'
	@'$(VIEWER)' still '$(WORK)/fit/bunny.reel' $(OUT)/fit/bunny.png --frame 0 --paint skeletons \
		--hide 0 --shape none --eye 0.9,-2.2,1.3 --target 0,0,0.6 --width 1.2 --size 480x420

.PHONY: bench
bench: ## measure
	$(CARGO) bench

# ---- the rest --------------------------------------------------------------------------------------------------------

INSTALL = VERSION='$(VERSION)' STATIC_LIBS='$(STATIC_LIBS)' STATICLIB='$(STATICLIB)' SHAREDLIB='$(SHAREDLIB)' \
	packaging/install.sh

.PHONY: install
install: ## install libraries, headers, pkg-config and CMake files (PREFIX, DESTDIR, LIBDIR, INCLUDEDIR)
	@# Takes what the last build left, so that `sudo make install` needs no cargo.
	@test -f '$(STATICLIB)' && test -f '$(SHAREDLIB)' || $(MAKE) build
	@PREFIX='$(PREFIX)' DESTDIR='$(DESTDIR)' LIBDIR='$(LIBDIR)' INCLUDEDIR='$(INCLUDEDIR)' $(INSTALL)

.PHONY: deps
deps: ## fetch what the tests need (Debian-like systems; elsewhere it says what is missing)
	@tools/deps.sh test

.PHONY: clean
clean: ## remove what was built
	$(CARGO) clean
	rm -rf '$(WORK)' $(OUT)

.PHONY: help
help: ## this list
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/  make \1|\2/p' $(firstword $(MAKEFILE_LIST)) | \
		while IFS='|' read -r name text; do printf '%-16s %s\n' "$$name" "$$text"; done
