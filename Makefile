# groomd: `make run` and `make test` do everything from a bare Debian 12 machine.
#
#   make            groomd, groom-worker, groomctl and libgroom in build/
#   make run        a daemon that has fitted the bundled sample, and the address to open
#   make test       lint, unit, property, fuzz corpus, API and end-to-end tests
#   make test-service  1 000 kills, 1 000 connections, 20 000 bent calls; below the storage each write, sync, rename and
#                      allocation fails in turn (make test has short forms)
#   make soak       SOAK_MINUTES (60) of a steady mixture: memory and descriptors stay flat
#   make test-cluster  fits on a Slurm cluster of two nodes on loopback (installs slurm-wlm and munge)
#   make test-deploy   the Debian package, the systemd unit, nginx in front (installs nginx)
#   make deb        build/groomd_VERSION_ARCH.deb
#   make bench      a table of figures, and build/bench.json
#   make real-captures  fits of real captures: pictures and reports (CAPTURES names their folder)
#   make real-retargets  real captures on reshaped copies of their bodies: pictures before and after, and reports
#   make asan tsan  the tests under AddressSanitizer and ThreadSanitizer
#   make fuzz       libFuzzer on every parser, FUZZ_SECONDS each
#   make docs-pictures  the pictures of the help (client/docs), by the project's own renderer
#   make lint       include directions, cppcheck, shell and JSON syntax
#   make install    into PREFIX (/usr/local), DESTDIR honoured
#
# BUILD names the output folder, VARIANT its flags (release, asan, tsan).

VARIANT ?= release
BUILD   ?= build$(if $(filter-out release,$(VARIANT)),/$(VARIANT))
PREFIX  ?= /usr/local
FUZZ_SECONDS ?= 60
# Set-up runs first and then a make of its own, which sees what was installed; it builds in parallel
# unless the caller has said how.
SUBMAKE = $(MAKE) --no-print-directory $(if $(findstring -j,$(MAKEFLAGS)),,-j$(shell nproc))

WARNINGS = -Wall -Wextra -Werror -Wshadow -Wpointer-arith -Wstrict-prototypes -Wmissing-prototypes \
           -Wvla -Wwrite-strings -Wformat=2 -Wno-unused-parameter -Wno-psabi
FLAGS_release = -O3 -g -fno-math-errno
FLAGS_asan    = -O1 -g -fno-math-errno -fsanitize=address,undefined -fno-sanitize-recover=undefined -fno-omit-frame-pointer
FLAGS_tsan    = -O1 -g -fno-math-errno -fsanitize=thread -fno-omit-frame-pointer
# No contraction: the scalar, AVX2 and AVX-512 builds of one kernel must give the same bits.
# Nobody reads the floating-point exception flags: without them, selections become vector blends.
CFLAGS_ALL = -std=c11 -D_GNU_SOURCE -fPIC -pthread -ffp-contract=off -fno-trapping-math -fvisibility=default \
             $(WARNINGS) $(FLAGS_$(VARIANT)) $(CFLAGS)
INCLUDES   = -Ilib/include -Ilib -I. -Iproto -Iserver $(CFLAGS_PACKAGES)
# Packages may arrive in this very make run, so they are asked for when first used, once.
CFLAGS_PACKAGES = $(eval CFLAGS_PACKAGES := $(shell pkg-config --cflags libcjson libpng zlib libmicrohttpd sqlite3 libcurl openssl qhull_r 2>/dev/null))$(CFLAGS_PACKAGES)
LIBS_LIB    = -lflann -llz4 -lopenblas -lembree3 -lqhull_r -lpng -lz -lcjson -lm
LIBS_SERVER = -lmicrohttpd -lsqlite3 -lcurl -lcrypto

find_c = $(sort $(shell find $(1) -name '*.c' 2>/dev/null))
objects = $(patsubst %.c,$(BUILD)/obj/%.o,$(1))

LIB_SOURCES    := $(call find_c,lib)
PROTO_SOURCES  := $(call find_c,proto)
WORKER_SOURCES := $(call find_c,server/worker)
DAEMON_SOURCES := $(filter-out $(WORKER_SOURCES),$(call find_c,server))
CLIENT_SOURCES := $(call find_c,client/groomctl)
ENGINE         := build/web/engine.wasm
MAINS          := server/groomd.c server/worker/main.c client/groomctl/main.c
SUPPORT_SOURCES:= $(call find_c,tests/support)
UNIT_TESTS     := $(patsubst tests/%.c,$(BUILD)/tests/%,$(call find_c,tests/unit tests/property))
BENCHES        := $(patsubst tests/%.c,$(BUILD)/tests/%,$(call find_c,tests/bench))
FUZZERS        := $(patsubst tests/fuzz/fuzz_%.c,%,$(wildcard tests/fuzz/fuzz_*.c))

LIBGROOM = $(BUILD)/libgroom.a
PROTO_A  = $(BUILD)/libproto.a
# The daemon's and the client's parts without their main(): what tests link.
PARTS_A  = $(BUILD)/libparts.a
PROGRAMS = $(foreach m,$(wildcard $(MAINS)),$(BUILD)/$(PROGRAM_OF_$(subst /,_,$(m))))
PROGRAM_OF_server_groomd.c = groomd
PROGRAM_OF_server_worker_main.c = groom-worker
PROGRAM_OF_client_groomctl_main.c = groomctl

.PHONY: all setup programs lib run test unit check-all test-service soak test-cluster test-deploy docs-pictures deb bench real-captures real-retargets asan tsan fuzz fuzz-corpus lint install clean api e2e node-packages tests
.DEFAULT_GOAL := all

all: setup
	+@$(SUBMAKE) programs

setup:
	@deploy/setup.sh

lib: $(LIBGROOM) $(BUILD)/libgroom.so
programs: lib $(PROGRAMS) $(ENGINE)

$(BUILD)/obj/%.o: %.c
	@mkdir -p $(@D)
	$(CC) $(CFLAGS_ALL) $(INCLUDES) -MMD -MP -c $< -o $@

$(LIBGROOM): $(call objects,$(LIB_SOURCES))
	@mkdir -p $(@D); rm -f $@
	$(AR) rcs $@ $^

$(BUILD)/libgroom.so: $(call objects,$(LIB_SOURCES))
	@mkdir -p $(@D)
	$(CC) $(CFLAGS_ALL) -shared -Wl,-soname,libgroom.so -o $@ $^ $(LDFLAGS) $(LIBS_LIB)

$(PROTO_A): $(call objects,$(PROTO_SOURCES))
	@mkdir -p $(@D); rm -f $@
	$(AR) rcs $@ $^

$(PARTS_A): $(call objects,$(filter-out $(MAINS),$(DAEMON_SOURCES) $(WORKER_SOURCES) $(CLIENT_SOURCES)))
	@mkdir -p $(@D); rm -f $@
	$(AR) rcs $@ $^

# --- the web page's engine ----------------------------------------------------------

# The model for WebAssembly, from the same sources. The same arithmetic in the
# same order (no contraction): a strand's numbers are the same bits in the page and in the daemon.
# Documents are taken apart by engine.mjs. It is linked without -O: with it clang hands what it has linked to wasm-opt
# where that is installed, which refuses vectors that it was not told of. Random123 asks for a processor that it knows; any will do.
ENGINE_SOURCES = $(addprefix lib/base/,diag.c memory.c pool_serial.c random.c sort.c status.c) \
                 $(filter-out lib/model/document_%,$(call find_c,lib/model)) lib/strands/strands.c lib/render/light.c \
                 client/web/engine/engine.c
ENGINE_FLAGS   = --target=wasm32-wasi -std=c11 -D_GNU_SOURCE -O3 -msimd128 -ffp-contract=off -fno-math-errno \
                 -fno-trapping-math -ffunction-sections $(WARNINGS) -Ilib/include -Ilib
ENGINE_OBJECTS = $(patsubst %.c,build/web/obj/%.o,$(ENGINE_SOURCES))
build/web/obj/lib/base/random.o: ENGINE_FLAGS += -D__riscv
build/web/obj/%.o: %.c
	@mkdir -p $(@D)
	clang $(ENGINE_FLAGS) -MMD -MP -c $< -o $@
$(ENGINE): $(ENGINE_OBJECTS)
	clang --target=wasm32-wasi -mexec-model=reactor -Wl,-O3 -Wl,--gc-sections,--strip-all -o $@ $^ -lm

# The studio: bundled and compressed by esbuild.
STUDIO         = build/web/studio/.bundled
$(STUDIO): $(wildcard client/web/*.mjs client/web/index.html) $(shell find client/web/src client/web/engine -type f) $(ENGINE) client/web/node_modules/.installed
	node client/web/build.mjs $(ENGINE) $(@D)
	@touch $@

# The help: pages and pictures in one file.
DOCS           = build/web/docs.pack
$(DOCS): $(wildcard client/docs/*.md client/docs/docs.css client/docs/build.mjs client/docs/pictures/*) client/web/node_modules/.installed
	@mkdir -p $(@D)
	node client/docs/build.mjs $@

# Files that are embedded (proto/embed.h).
$(BUILD)/obj/server/http/docs.o: $(DOCS)
$(BUILD)/obj/server/http/studio.o: $(STUDIO)
$(BUILD)/obj/server/http/about.o: proto/openapi.json
$(BUILD)/obj/server/http/page.o: server/http/status.css

$(BUILD)/groomd: $(call objects,server/groomd.c $(filter-out $(MAINS),$(DAEMON_SOURCES)))
$(BUILD)/groom-worker: $(call objects,$(WORKER_SOURCES))
$(BUILD)/groomctl: $(call objects,$(CLIENT_SOURCES))
$(BUILD)/groomd $(BUILD)/groom-worker $(BUILD)/groomctl: $(PROTO_A) $(LIBGROOM)
	$(CC) $(CFLAGS_ALL) -o $@ $(filter %.o,$^) $(PROTO_A) $(LIBGROOM) $(LDFLAGS) $(LIBS_SERVER) $(LIBS_LIB)

# --- tests ---------------------------------------------------------------------

$(BUILD)/tests/%: $(BUILD)/obj/tests/%.o $(call objects,$(SUPPORT_SOURCES)) $(PARTS_A) $(PROTO_A) $(LIBGROOM)
	@mkdir -p $(@D)
	$(CC) $(CFLAGS_ALL) -o $@ $< $(call objects,$(SUPPORT_SOURCES)) $(PARTS_A) $(PROTO_A) $(LIBGROOM) $(LDFLAGS) \
	    $(LIBS_SERVER) $(LIBS_LIB) -lcheck -lsubunit -lrt -lm

# Preloaded into groomd by tests/faults.
FAULT_LIBRARY = $(BUILD)/tests/libfault.so
$(FAULT_LIBRARY): tests/faults/libfault.c
	@mkdir -p $(@D)
	$(CC) -std=c11 -D_GNU_SOURCE -fPIC -shared -O1 -g $(WARNINGS) $(if $(filter-out release,$(VARIANT)),-DWITHOUT_ALLOCATOR) \
	    -o $@ $< -ldl

tests: $(UNIT_TESTS) $(FAULT_LIBRARY)

test: setup
	+@$(SUBMAKE) check-all

check-all: programs tests fuzz-corpus node-packages
	+@$(SUBMAKE) lint
	@BUILD=$(BUILD) tests/run.sh

unit: programs tests
	@BUILD=$(BUILD) tests/run.sh unit

api e2e: programs node-packages
	@BUILD=$(BUILD) tests/run.sh $@

# What a service must withstand, in full; `make test` has short forms of it.
test-service: setup
	+@$(SUBMAKE) programs node-packages $(FAULT_LIBRARY)
	@FAULTS=all BUILD=$(BUILD) KILLS=$(or $(KILLS),1000) CONNECTIONS=$(or $(CONNECTIONS),1000) \
	    FUZZ_CALLS=$(or $(FUZZ_CALLS),20000) tests/run.sh faults e2e/kills e2e/connections api/fuzz

SOAK_MINUTES ?= 60
soak: setup
	+@$(SUBMAKE) programs node-packages
	@BUILD=$(BUILD) SOAK_SECONDS=$$(($(SOAK_MINUTES) * 60)) tests/run.sh e2e/soak

# Not part of `make test`: it installs what most machines do not have.
test-cluster: setup
	@deploy/setup.sh packages-cluster.txt
	+@$(SUBMAKE) programs node-packages
	@BUILD=$(BUILD) tests/run.sh cluster

test-deploy: setup
	@deploy/setup.sh packages-deploy.txt
	+@$(SUBMAKE) programs node-packages
	@BUILD=$(BUILD) tests/run.sh deploy

deb: setup
	+@$(SUBMAKE) programs
	@BUILD=$(BUILD) deploy/debian/build.sh

node-packages: tests/node_modules/.installed
%/node_modules/.installed: %/package.json %/package-lock.json
	@echo "setup: installing the npm packages of $*/package-lock.json"
	cd $* && npm ci --no-audit --no-fund --ignore-scripts
	@touch $@

asan tsan:
	@deploy/setup.sh
	+@$(SUBMAKE) VARIANT=$@ programs tests node-packages
	@BUILD=build/$@ VARIANT=$@ tests/run.sh

# --- fuzzing --------------------------------------------------------------------

# Every parser under libFuzzer with AddressSanitizer (clang). The corpus of each is replayed by
# `make test` through the same entry point, built by the ordinary compiler.
FUZZ_BUILD = build/fuzz
FUZZ_FLAGS = -std=c11 -D_GNU_SOURCE -O1 -g -fsanitize=address,undefined -fno-sanitize-recover=undefined -Wno-pass-failed
fuzz_objects = $(patsubst %.c,$(FUZZ_BUILD)/obj/%.o,$(1))
$(FUZZ_BUILD)/obj/%.o: %.c
	@mkdir -p $(@D)
	clang $(FUZZ_FLAGS) -fsanitize=fuzzer-no-link $(INCLUDES) -MMD -MP -c $< -o $@
$(FUZZ_BUILD)/fuzz_%: $(FUZZ_BUILD)/obj/tests/fuzz/fuzz_%.o $(call fuzz_objects,$(LIB_SOURCES) $(PROTO_SOURCES))
	clang $(FUZZ_FLAGS) -fsanitize=fuzzer -o $@ $^ $(LIBS_LIB) $(LIBS_SERVER) -pthread

fuzz: setup
	+@$(SUBMAKE) $(addprefix $(FUZZ_BUILD)/fuzz_,$(FUZZERS))
	@set -e; for f in $(FUZZERS); do \
	    mkdir -p build/fuzz/corpus/$$f; echo "fuzz: $$f for $(FUZZ_SECONDS) s"; \
	    $(FUZZ_BUILD)/fuzz_$$f -max_total_time=$(FUZZ_SECONDS) -timeout=10 -rss_limit_mb=1024 -print_final_stats=1 \
	        build/fuzz/corpus/$$f tests/fuzz/corpus/$$f; \
	done

fuzz-corpus: $(addprefix $(BUILD)/tests/fuzz/replay_,$(FUZZERS))
$(BUILD)/tests/fuzz/replay_%: $(BUILD)/obj/tests/fuzz/fuzz_%.o $(BUILD)/obj/tests/fuzz/replay.o $(PROTO_A) $(LIBGROOM)
	@mkdir -p $(@D)
	$(CC) $(CFLAGS_ALL) -o $@ $(filter %.o,$^) $(PROTO_A) $(LIBGROOM) $(LDFLAGS) $(LIBS_LIB) $(LIBS_SERVER)

# --- benchmarks, lint, run, install -------------------------------------------------

bench: setup
	+@$(SUBMAKE) programs node-packages $(BENCHES)
	@BUILD=$(BUILD) tests/bench/run.sh

CAPTURES ?= ../shared/data
real-captures: setup
	+@$(SUBMAKE) $(BUILD)/tests/bench/real_captures
	@mkdir -p $(BUILD)/real-captures
	@$(BUILD)/tests/bench/real_captures $(CAPTURES) $(BUILD)/real-captures

docs-pictures: setup
	+@$(SUBMAKE) programs node-packages
	@BUILD=$(BUILD) node client/docs/pictures.mjs

real-retargets: setup
	+@$(SUBMAKE) programs node-packages
	@BUILD=$(BUILD) node --test --test-reporter=spec tests/captures/retarget.mjs

lint:
	@tests/lint.sh

run: setup
	+@$(SUBMAKE) programs
	@BUILD=$(BUILD) deploy/run.sh

install: programs
	install -d $(DESTDIR)$(PREFIX)/bin $(DESTDIR)$(PREFIX)/lib $(DESTDIR)$(PREFIX)/include/groom $(DESTDIR)$(PREFIX)/share/groomd
	install -m 755 $(PROGRAMS) $(DESTDIR)$(PREFIX)/bin
	install -m 644 $(LIBGROOM) $(DESTDIR)$(PREFIX)/lib
	install -m 755 $(BUILD)/libgroom.so $(DESTDIR)$(PREFIX)/lib
	install -m 644 lib/include/groom/*.h $(DESTDIR)$(PREFIX)/include/groom
	install -d $(DESTDIR)$(PREFIX)/share/man/man1 $(DESTDIR)$(PREFIX)/share/bash-completion/completions
	$(BUILD)/groomctl manual >$(DESTDIR)$(PREFIX)/share/man/man1/groomctl.1
	$(BUILD)/groomctl completion bash >$(DESTDIR)$(PREFIX)/share/bash-completion/completions/groomctl
	install -d $(DESTDIR)$(PREFIX)/share/zsh/site-functions
	$(BUILD)/groomctl completion zsh >$(DESTDIR)$(PREFIX)/share/zsh/site-functions/_groomctl
	install -m 644 proto/openapi.yaml $(DESTDIR)$(PREFIX)/share/groomd

clean:
	rm -rf build

.SECONDARY:
-include $(shell find $(BUILD)/obj $(FUZZ_BUILD)/obj build/web/obj -name '*.d' 2>/dev/null)
