# SPDX-License-Identifier: MIT
# sonard - see README.md. `make help` lists the targets.
#
# Every .c below a folder belongs to that folder's archive; tests/unit/**/test_X.c, tests/fuzz/fuzz_X.c,
# tests/bench/bench_X.c, tests/sim/X.c and report/report_X.c are one program each. BUILD=dir and SAN=address,undefined make other builds beside.
# `make check` is the gate: what must pass before a change lands, and depends on no clock. `make check-long` is everything else.

CC       ?= cc
PKG_CONFIG ?= pkg-config
BUILD    ?= build
VERSION  := $(shell cat VERSION 2>/dev/null || echo 0)
SAN      ?=
PREFIX   ?= /usr/local

# In a checkout a warning is an error; a package is also built by compilers that warn of more.
WERROR   ?= $(if $(wildcard .git),-Werror)
WARN     := -Wall -Wextra -Wconversion -Wshadow -Wstrict-prototypes -Wformat-security $(WERROR)
# -ffp-contract=off: the same bits on every CPU. -fno-math-errno: lets sqrt be an instruction. -fno-trapping-math: lets
# choices between floats be vectors; it changes no value.
CFLAGS   ?= -O2 -g
# _FORTIFY_SOURCE needs an optimizing compiler and hides faults from sanitizers; the caller's own stays. The other two are
# not there for every compiler and machine.
OPTIMIZED := $(filter-out -O0,$(lastword $(filter -O%,$(CFLAGS))))
FORTIFY  := $(if $(SAN)$(findstring _FORTIFY_SOURCE,$(CPPFLAGS) $(CFLAGS)),,$(if $(OPTIMIZED),-U_FORTIFY_SOURCE -D_FORTIFY_SOURCE=2))
has       = $(shell $(filter-out --coverage,$(CC)) -Werror $(1) -x c -fsyntax-only /dev/null 2>/dev/null && echo $(1))
HARDEN   := $(FORTIFY) $(call has,-fstack-protector-strong) $(call has,-fstack-clash-protection)
# libgpiod 1 and 2 are different libraries of one name; without any there are no GPIO lines.
GPIOD    := $(or $(firstword $(subst ., ,$(shell $(PKG_CONFIG) --modversion libgpiod 2>/dev/null))),0)
# Without libwebsockets there is no sonard-web.
WEB      := $(if $(shell $(PKG_CONFIG) --modversion libwebsockets 2>/dev/null),web)
PACKAGES := libmodbus inih jansson liblz4 libzstd zlib $(if $(filter-out 0,$(GPIOD)),libgpiod)
# Captures outgrow the offsets of 32 bits that such machines have by default.
LARGE    := $(if $(filter arm% i%86%,$(shell $(CC) -dumpmachine 2>/dev/null)),-D_FILE_OFFSET_BITS=64)
ALLCFLAGS = -std=c17 -iquote . $(WARN) $(HARDEN) $(CPPFLAGS) $(CFLAGS) -ffp-contract=off -fno-math-errno -fno-trapping-math -fPIE \
            -ffile-prefix-map=$(CURDIR)=. -D_GNU_SOURCE $(LARGE) -DSONARD_VERSION='"$(VERSION)"' -DSONARD_GPIOD=$(GPIOD) \
            $(shell $(PKG_CONFIG) --cflags $(PACKAGES) 2>/dev/null) -MMD -MP \
            $(if $(SAN),-fsanitize=$(SAN) -fno-omit-frame-pointer -fno-sanitize-recover=all)
LDFLAGS  += -pie -Wl,-z,relro,-z,now $(if $(SAN),-fsanitize=$(SAN))
LIBS     := $(shell $(PKG_CONFIG) --libs $(PACKAGES) 2>/dev/null) -lm -pthread
# Once a make, not once a file; and without what a single program adds.
COMPILE  := $(CC) $(ALLCFLAGS)
# The compiler for the stamps: gcc and a cc that is gcc are one, another version of it is another.
COMPILER := $(shell $(CC) -v 2>&1 | grep ' version ') $(wordlist 2,$(words $(CC)),$(CC))
COMPILED := $(COMPILER) $(ALLCFLAGS)
LINKED   := $(COMPILER) $(LDFLAGS) $(LIBS)

# The .c files of a folder and of its rooms.
sources   = $(sort $(wildcard $(1)/*.c $(1)/*/*.c))
SRC      := $(foreach d,core grid drivers protocol config daemon client $(WEB),$(call sources,$(d)))
obj       = $(patsubst %.c,$(BUILD)/%.o,$(1))
CORE     := $(BUILD)/libcore.a
GRID     := $(BUILD)/libgrid.a
DRIVERS  := $(BUILD)/libdrivers.a
CONFIG   := $(BUILD)/libconfig.a
PROTOCOL := $(BUILD)/libprotocol.a
DAEMON   := $(BUILD)/libdaemon.a
CLIENT   := $(BUILD)/libclient.a
WEBLIB   := $(if $(WEB),$(BUILD)/libweb.a)
SIMLIB   := $(BUILD)/libsim.a
SEALIB   := $(BUILD)/libsea.a
PILOTLIB := $(BUILD)/libpilot.a
WATERLIB := $(BUILD)/libwater.a
ALL_A    := $(SEALIB) $(PILOTLIB) $(SIMLIB) $(WATERLIB) $(WEBLIB) $(CLIENT) $(DAEMON) $(CONFIG) $(PROTOCOL) $(DRIVERS) $(GRID) $(CORE)

PROGRAMS := $(BUILD)/sonard $(BUILD)/sonarctl $(BUILD)/sonard-mavlink $(if $(WEB),$(BUILD)/sonard-web)
LIBRARY  := $(BUILD)/libsonard.so.0
SCHEMA   := $(BUILD)/sonard-protocol.schema.json
# The unit tests mirror the source folders; their programs lie side by side.
UNIT_SRC := $(filter-out $(if $(WEB),,tests/unit/web/%),$(wildcard tests/unit/test_*.c tests/unit/*/test_*.c tests/unit/*/*/test_*.c))
UNIT     := $(patsubst %.c,$(BUILD)/tests/%,$(notdir $(UNIT_SRC)))
SIM      := $(patsubst tests/sim/%.c,$(BUILD)/tests/%,$(wildcard tests/sim/*.c))
BENCH    := $(patsubst tests/bench/%.c,$(BUILD)/tests/%,$(wildcard tests/bench/bench_*.c))
# Each fuzz target, run over its corpus alone.
CORPUS   := $(patsubst tests/fuzz/fuzz_%.c,$(BUILD)/tests/corpus_%,$(filter-out $(if $(WEB),,tests/fuzz/fuzz_web.c),$(wildcard tests/fuzz/fuzz_*.c)))
REPORT   := $(patsubst report/%.c,$(BUILD)/tests/%,$(wildcard report/report_*.c))
# A peer to measure against, where Debian's liboctomap-dev is installed, as make deps-long does.
OCTOMAP  := $(wildcard /usr/include/octomap/octomap.h)
PEER     := $(if $(OCTOMAP),$(BUILD)/tests/bench_octomap_peer)
HELPERS  := $(patsubst tests/tools/%.c,$(BUILD)/tests/%,$(wildcard tests/tools/*.c))
TOOLS    := $(patsubst tests/lib/%.c,$(BUILD)/tests/%.so,$(wildcard tests/lib/*.c))

.PHONY: all help deps deps-check deps-long clean programs unit tests measures corpus demo check check-long check-clang check-san check-live check-code \
        check-honest check-peers check-vm check-arm64 check-armhf bench-arm64 check-deb check-blueos check-web deb blueos layers format lint coverage mutants \
        fuzz model valgrind bench pilot report prose man install install-built uninstall soak
all: programs

programs: $(PROGRAMS) $(LIBRARY)
	@:
unit: $(UNIT)
tests: $(SCHEMA) $(BUILD)/sonard-protocol.7 $(BUILD)/sonard.conf.5 $(UNIT) $(SIM) $(HELPERS) $(TOOLS)
measures: $(BENCH) $(REPORT) $(PEER)
corpus: $(CORPUS)

# What a file was made with. It is written only when that changes, so that what depends on it is made anew then: other
# flags, another VERSION, a .c more or less.
keep      = @mkdir -p $(@D); printf '%s\n' '$(subst ','\'',$(1))' | cmp -s - $@ || printf '%s\n' '$(subst ','\'',$(1))' > $@
FORCE:
$(BUILD)/compile.stamp: FORCE
	@$(PKG_CONFIG) --exists --print-errors $(PACKAGES) || { echo '`make deps` installs what is missing' >&2; exit 1; }
	$(call keep,$(COMPILED))
$(BUILD)/link.stamp: FORCE
	$(call keep,$(LINKED))

# An archive of the objects of these .c files. Its stamp names the sources: BUILD may be said in more than one way.
define archive
$(1): $(call obj,$(2)) $(1:.a=.stamp)
$(1:.a=.stamp): FORCE
	$$(call keep,$(2))
endef
$(eval $(call archive,$(CORE),$(call sources,core)))
$(eval $(call archive,$(GRID),$(call sources,grid)))
$(eval $(call archive,$(DRIVERS),$(call sources,drivers)))
$(eval $(call archive,$(CONFIG),$(call sources,config)))
$(eval $(call archive,$(PROTOCOL),$(call sources,protocol)))
$(eval $(call archive,$(DAEMON),$(filter-out daemon/main.c,$(call sources,daemon))))
$(eval $(call archive,$(CLIENT),$(filter-out client/ctl/sonarctl.c client/mavlink/sonard-mavlink.c,$(call sources,client))))
$(if $(WEB),$(eval $(call archive,$(WEBLIB),$(filter-out web/sonard-web.c,$(call sources,web)))))
$(eval $(call archive,$(SIMLIB),$(wildcard tests/sim/lib/*.c)))
$(eval $(call archive,$(WATERLIB),$(wildcard tests/water/*.c tests/sound/*.c)))
$(eval $(call archive,$(SEALIB),$(wildcard report/lib/*.c)))
$(eval $(call archive,$(PILOTLIB),$(filter-out tests/pilot/pilot_runs.c,$(wildcard tests/pilot/*.c))))
$(BUILD)/%.a:
	@mkdir -p $(@D)
	@rm -f $@
	@$(AR) rcsD $@ $(filter %.o,$^)

$(BUILD)/%.o: %.c $(BUILD)/compile.stamp
	@mkdir -p $(@D)
	@echo '  CC    $<'
	@$(COMPILE) -c -o $@ $<

# Links the objects and archives that a program depends on.
define link
@mkdir -p $(@D)
@echo '  LD    $@'
@$(CC) $(LDFLAGS) $(call wraps,$(@F)) -o $@ $(filter %.o %.a,$^) $(LIBS)
endef

# Functions of which a test has its own: the linker wraps them.
WRAPS_test_template := malloc calloc
WRAPS_test_query_context := source_stats
WRAPS_test_drift_words := source_stats
WRAPS_test_input_port := port_find
WRAPS_test_depth := loop_clock
# It counts how often clients are compared with each other, and looked at.
WRAPS_test_server := session_is_kept peer_same_program peer_order
# What the disk says is the test's.
WRAPS_test_segments_outage := open write ftruncate sync_file_range stat
# Its port and its clock are the test's.
WRAPS_test_find_sonar := port_find poll clock_gettime
# All test_rig_*: their clock is turned by the test (tests/lib/rig.h).
WRAPS_test_rig := clock_gettime epoll_wait
wraps     = $(addprefix -Wl$(comma)--wrap=,$(WRAPS_$(if $(filter test_rig_%,$(1)),test_rig,$(1))))
comma    := ,

$(BUILD)/sonard: $(BUILD)/daemon/main.o $(DAEMON) $(CONFIG) $(PROTOCOL) $(DRIVERS) $(GRID) $(CORE) $(BUILD)/link.stamp
	$(link)
$(BUILD)/sonarctl: $(BUILD)/client/ctl/sonarctl.o $(CLIENT) $(DAEMON) $(CONFIG) $(PROTOCOL) $(DRIVERS) $(GRID) $(CORE) $(BUILD)/link.stamp
	$(link)

$(BUILD)/sonard-mavlink: $(BUILD)/client/mavlink/sonard-mavlink.o $(CLIENT) $(CONFIG) $(CORE) $(BUILD)/link.stamp
	$(link)

$(BUILD)/sonard-web: $(BUILD)/web/sonard-web.o $(WEBLIB) $(CLIENT) $(CONFIG) $(PROTOCOL) $(CORE) $(BUILD)/link.stamp
	$(link)
$(BUILD)/sonard-web: private LIBS += $(shell $(PKG_CONFIG) --libs-only-L --libs-only-l libwebsockets 2>/dev/null)
# The files of the page are in it.
$(BUILD)/web/web_files.o: $(wildcard web/page/*)

# For other people's programs; ours have the same objects linked in.
$(BUILD)/%.pic.o: %.c $(BUILD)/compile.stamp
	@mkdir -p $(@D)
	@echo '  CC    $< (shared)'
	@$(COMPILE) -fPIC -c -o $@ $<
$(LIBRARY): $(BUILD)/client/lib/sonard_client.pic.o $(BUILD)/client/lib/sonard_answers.pic.o client/lib/libsonard.map $(BUILD)/link.stamp
	@echo '  LD    $@'
	@$(CC) -shared -Wl,-soname,$(@F) -Wl,--version-script,$(filter %.map,$^) $(filter-out -pie,$(LDFLAGS)) -o $@ $(filter %.o,$^) $(shell $(PKG_CONFIG) --libs jansson)

# Test programs may look everywhere. Static patterns: as implicit rules these would match their own prerequisites.
unit_obj  = $(foreach u,$(UNIT_SRC),$(if $(filter $(1),$(notdir $(u:.c=))),$(BUILD)/$(u:.c=.o)))
.SECONDEXPANSION:
$(UNIT): $(BUILD)/tests/%: $$(call unit_obj,$$*) $(ALL_A) $(BUILD)/link.stamp
	$(link)
$(BUILD)/tests/test_sim_program: | $(BUILD)/tests/ping360_sim
$(CORPUS): $(BUILD)/tests/corpus_%: $(BUILD)/tests/fuzz/fuzz_%.o $(BUILD)/tests/fuzz/corpus.o $(ALL_A) $(BUILD)/link.stamp
	$(link)
$(SIM): $(BUILD)/tests/%: $(BUILD)/tests/sim/%.o $(SIMLIB) $(WATERLIB) $(DRIVERS) $(GRID) $(CORE) $(BUILD)/link.stamp
	$(link)
$(BENCH): $(BUILD)/tests/%: $(BUILD)/tests/bench/%.o $(ALL_A) $(BUILD)/link.stamp
	$(link)
$(REPORT): $(BUILD)/tests/%: $(BUILD)/report/%.o $(ALL_A) $(BUILD)/link.stamp
	$(link)
$(BUILD)/tests/report_water: $(BUILD)/report/peer_$(if $(OCTOMAP),octomap,none).o
$(BUILD)/tests/report_water: private LIBS += $(if $(OCTOMAP),-loctomap -loctomath -lstdc++)
$(BUILD)/report/peer_octomap.o: report/peer_octomap.cc report/peer.h
	@mkdir -p $(@D)
	@echo '  CXX   $<'
	@$(CXX) -std=c++17 -iquote . -Wall -Wextra -Werror -O2 -c -o $@ $<
$(BUILD)/tests/bench_octomap_peer: tests/bench/octomap_peer.cc tests/bench/voxel_scene.h $(GRID) $(CORE)
	@mkdir -p $(@D)
	@echo '  CXX   $@'
	@$(CXX) -std=c++17 -iquote . -Wall -Wextra -Werror $(CFLAGS) -o $@ $< $(GRID) $(CORE) -loctomap -loctomath
$(HELPERS): $(BUILD)/tests/%: $(BUILD)/tests/tools/%.o $(CLIENT) $(CONFIG) $(DRIVERS) $(GRID) $(CORE) $(BUILD)/link.stamp
	$(link)
$(BUILD)/tests/pilot_runs: $(BUILD)/tests/pilot/pilot_runs.o $(ALL_A) $(BUILD)/link.stamp
	$(link)
$(TOOLS): $(BUILD)/tests/%.so: tests/lib/%.c
	@mkdir -p $(@D)
	@$(CC) -shared -fPIC -O2 -D_GNU_SOURCE -o $@ $< -ldl

# ---- what a person types ----

help:
	@echo 'make            build sonard, sonarctl, sonard-mavlink and (with libwebsockets) sonard-web into $(BUILD)/'
	@echo 'make demo       install what is missing (INSTALL=no: only name it), build, replay a real recording, print its sectors, draw them'
	@echo 'make check      install what is missing, build, run every test whose verdict depends on no clock: what a change must pass'
	@echo 'make check-long everything else, part by part, and a table of it (ONLY="check-live fuzz": these parts); wants an idle machine'
	@echo 'make check-honest no clear is false, in all worlds of test_honest_* and all voyages of test_course (the gate has a few)'
	@echo 'make check-live the daemon with virtual sonars and real clients, against the clock; check-web the page in a browser'
	@echo 'make check-san  the tests under address+undefined and under thread sanitizer; check-clang the unit tests built by clang'
	@echo 'make check-code layout, clang-tidy, prose, what may go; check-peers the formats against peers from npm'
	@echo 'make model      the lock-free parts as Spin models; make valgrind: memcheck'
	@echo 'make check-vm   what needs a kernel with CAN and GPIO, and the service under systemd, in virtual machines'
	@echo 'make check-arm64 the unit tests and a replay for arm64, under qemu-user; check-armhf: for ARM of 32 bits'
	@echo 'make deb        the Debian packages of this machine into $(BUILD)/deb; then: apt install ./$(BUILD)/deb/sonard_*.deb'
	@echo 'make check-deb  the packages for amd64 and arm64 in a clean Debian into $(BUILD)/deb, twice the same, clean for lintian'
	@echo 'make blueos     the BlueOS extension as an OCI image into $(BUILD)/blueos (ARCHS="amd64 arm64 armhf"); make check-blueos runs it'
	@echo 'make coverage   which lines the unit tests, the gate and the live suites reach'
	@echo 'make mutants    change grid/, drivers/ and daemon/ in many places, one at a time: does a test notice? (MUTANTS="--sample 200 --seed 7")'
	@echo 'make fuzz       run every fuzz target for SECONDS (20) each'
	@echo 'make soak       load that stays: a day in virtual time, and an hour in which every wire fails, clients come and go (HOURS, MINUTES)'
	@echo 'make bench      measure: scaling, ratios, every part by itself; $(BUILD)/bench.json (QUICK=1: shorter, LONG=1: all sizes)'
	@echo 'make bench-arm64 instructions of a ping and of questions for arm64, under qemu-user, as a share of a Raspberry Pi 4'
	@echo 'make pilot      drive a vehicle by the answers through worlds drawn at random: $(BUILD)/pilot/ (SEEDS=72, so many drives)'
	@echo 'make score      what is found and said beside rivals, one table in report/scores/ (RELEASE=1: once a version, over new seeds)'
	@echo 'make report     error against run time, measured: $(BUILD)/report/index.html, in minutes (QUICK=1: seconds, LONG=1: with a billion updates)'
	@echo 'make man        the manual pages for man -l, with the keys and methods that the program has'
	@echo 'make prose      plain English in what people read: glossary, lengths of sentences, spelling (tests/prose)'
	@echo 'make layers     who may include whom'
	@echo 'make format     lay all C files out as .clang-format says'
	@echo 'make lint       check that layout, and what clang-tidy can find (.clang-tidy)'
	@echo 'make install    programs, manual pages, configuration and services below DESTDIR$(PREFIX); make uninstall'

deps:
	@tests/deps.sh build
deps-check:
	@tests/deps.sh check
deps-long:
	@tests/deps.sh long

demo: deps
	@$(MAKE) --no-print-directory programs $(BUILD)/tests/walls
	@BUILD=$(BUILD) tests/demo.sh

# Of what is built before all tests; a -j that was given holds instead.
PARALLEL = $(if $(findstring jobserver,$(MAKEFLAGS)),,-j$(shell nproc))
# Prints "N passed, N failed, N skipped".
RUN_TESTS := tests/run.sh

# ---- the gate ----
# PATIENCE scales the limits that end what hangs; nothing here measures. The slowest start first.

LIVE     := $(filter-out tests/live/test_blueos.py tests/live/test_web_page.py tests/live/test_campaign.py,$(sort $(wildcard tests/live/test_*.py)))
GATE_LIVE := $(shell grep -l 'gate=' $(LIVE))
# In virtual time: all of it depends on no clock.
VOYAGES  := $(sort $(wildcard tests/voyage/test_*.py))
UNIT_SLOW := $(addprefix $(BUILD)/tests/,test_honest test_honest_drift test_honest_heading test_course test_honest_jumps)
# Under address+undefined: what reads foreign bytes, and what belongs to a program.
GUARDED  := $(filter-out test_honest% test_rig_%,$(notdir $(patsubst %.c,%,$(filter-out tests/unit/grid/% tests/unit/pilot/% tests/unit/report/% tests/unit/sim/%,$(UNIT_SRC)))))
ASAN     := CC=gcc SAN=address,undefined CFLAGS='-O1 -g' BUILD=$(BUILD)/asan
# The named changes are found where they were: whoever changes such a line changes the list.
NAMED    := tests/mutants/mutants.py\ --named\ --list
GATE      = $(UNIT_SLOW) tests/layers.sh tests/service.sh $(NAMED) tests/replay/box.sh tests/replay/cleanup.sh $(GATE_LIVE:%=%\ --gate) $(VOYAGES) \
            $(filter-out $(UNIT_SLOW),$(UNIT)) $(GUARDED:%=$(BUILD)/asan/tests/%) $(CORPUS:$(BUILD)/%=$(BUILD)/asan/%)

check: export PATIENCE ?= 6
check: deps-check
	@$(MAKE) --no-print-directory $(PARALLEL) CC=gcc programs tests
	@$(MAKE) --no-print-directory $(PARALLEL) $(ASAN) guarded
	@BUILD=$(BUILD) LIMIT=1800 $(RUN_TESTS) $(GATE)

.PHONY: guarded
guarded: $(GUARDED:%=$(BUILD)/tests/%) $(CORPUS)

# ---- everything else ----

PARTS    := check-code check-clang check-honest check-live check-web check-san fuzz check-peers model valgrind check-report check-vm check-deb check-arm64 check-armhf check-blueos soak
# Each part to its end, whatever becomes of the others.
check-long:
	@BUILD=$(BUILD) MAKE='$(MAKE)' tests/long.sh $(or $(ONLY),$(PARTS))

check-clang: deps-long
	@$(MAKE) --no-print-directory $(PARALLEL) CC=clang BUILD=$(BUILD)/clang programs tests measures
	@BUILD=$(BUILD)/clang LIMIT=1800 $(RUN_TESTS) $(UNIT:$(BUILD)/%=$(BUILD)/clang/%) tests/replay/box.sh tests/replay/cleanup.sh

# The gate has a few of these worlds and voyages.
check-honest: deps-check
	@$(MAKE) --no-print-directory $(PARALLEL) CC=gcc programs tests
	@LONG=1 BUILD=$(BUILD) LIMIT=1800 $(RUN_TESTS) $(UNIT_SLOW)

# What fails is tried once more, alone: these measure, and a machine that others use may miss a bound.
check-live: deps-long
	@$(MAKE) --no-print-directory $(PARALLEL) programs tests
	@echo 'these assert latencies and rates: the machine should be idle'
	@BUILD=$(BUILD) AGAIN=1 LIMIT=900 $(RUN_TESTS) $(LIVE)

check-web:
	@tests/deps.sh web
	@$(MAKE) --no-print-directory $(PARALLEL) programs tests
	@BUILD=$(BUILD) AGAIN=1 LIMIT=900 $(RUN_TESTS) tests/live/test_web_page.py

# What has one thread has nothing for the thread sanitizer: unit tests of such modules, and live tests of the clients.
THREADED := $(patsubst %.c,%,$(notdir $(shell grep -lE '"(core/(latency|log|loop|ring|snapshot|worker)|daemon/)|pthread' $(UNIT_SRC))))
CLIENTS  := $(patsubst %,tests/live/test_%.py,archive completion docs import_formats imports mavlink mistakes rosbag schema setup top tune web)
TSAN     := CC=clang SAN=thread BUILD=$(BUILD)/tsan

check-san: deps-long
	@$(MAKE) --no-print-directory $(PARALLEL) $(ASAN) programs tests
	@BUILD=$(BUILD)/asan AGAIN=1 LIMIT=1800 $(RUN_TESTS) $(LIVE) $(VOYAGES) $(UNIT:$(BUILD)/%=$(BUILD)/asan/%)
	@$(MAKE) --no-print-directory $(PARALLEL) $(TSAN) programs tests
	@BUILD=$(BUILD)/tsan AGAIN=1 LIMIT=1800 $(RUN_TESTS) $(filter-out $(CLIENTS),$(LIVE)) $(VOYAGES) $(THREADED:%=$(BUILD)/tsan/tests/%)

# The text and the shape of the code and of what people read.
check-code: deps-long
	@tests/deps.sh lint
	@$(MAKE) --no-print-directory $(PARALLEL) programs
	@BUILD=$(BUILD) GPIOD=$(GPIOD) LIMIT=1800 $(RUN_TESTS) tests/lint.sh tests/prose/check.py tests/build.sh tests/adding.sh tests/unused.sh

# Readers from npm and from Debian of what sonard writes and speaks.
check-peers: deps-long
	@$(MAKE) --no-print-directory $(PARALLEL) programs tests
	@BUILD=$(BUILD) LIMIT=900 $(RUN_TESTS) tests/mcap/check.sh tests/mavlink/check.sh tests/gpiod2.sh

model: deps-long
	@BUILD=$(BUILD) LIMIT=1800 $(RUN_TESTS) tests/model/run.sh

valgrind: deps-long
	@$(MAKE) --no-print-directory $(PARALLEL) programs unit
	@BUILD=$(BUILD) LIMIT=1800 $(RUN_TESTS) tests/valgrind.sh

.PHONY: check-report
check-report: deps-long
	@$(MAKE) --no-print-directory $(PARALLEL) programs measures
	@BUILD=$(BUILD) LIMIT=1800 $(RUN_TESTS) report/check.py

check-vm:
	@tests/deps.sh vm
	@$(MAKE) --no-print-directory programs tests
	@BUILD=$(BUILD) LIMIT=1800 JOBS=1 $(RUN_TESTS) tests/vm/run.sh tests/vm/run.sh\ --systemd

check-arm64 check-armhf: check-%:
	@tests/deps.sh $*
	@$(MAKE) --no-print-directory programs
	@BUILD=$(BUILD) LIMIT=7200 $(RUN_TESTS) "tests/cross.sh $*"

bench-arm64:
	@tests/deps.sh arm64
	@BUILD=$(BUILD) tests/cross.sh arm64 count

check-deb:
	@tests/deps.sh deb
	@BUILD=$(BUILD) LIMIT=3600 $(RUN_TESTS) tests/deb.sh

# The package for this machine, from this tree, into BUILD/deb; debian/control names what that needs.
deb:
	@tests/deps.sh deb
	@rm -rf $(BUILD)/deb
	@packaging/copy.sh $(BUILD)/deb/sonard
	@cd $(BUILD)/deb/sonard && dpkg-buildpackage -us -uc -b
	@ls $(BUILD)/deb/*.deb

# The extension's images, and this machine's run in a container.
ARCHS ?= amd64 arm64 armhf
blueos:
	@tests/deps.sh blueos
	@BUILD=$(BUILD) packaging/blueos/build.sh $(ARCHS)
check-blueos:
	@tests/deps.sh blueos
	@$(MAKE) --no-print-directory programs tests
	@BUILD=$(BUILD) packaging/blueos/build.sh $(shell dpkg --print-architecture)
	@BUILD=$(BUILD) $(RUN_TESTS) tests/live/test_blueos.py

prose:
	@BUILD=$(BUILD) tests/prose/check.py

layers: $(CORE) $(GRID) $(DRIVERS) $(CONFIG) $(PROTOCOL) $(DAEMON) $(CLIENT) $(WEBLIB)
	@BUILD=$(BUILD) tests/layers.sh

format:
	@tests/deps.sh lint
	@tests/lint.sh format

lint:
	@tests/deps.sh lint
	@GPIOD=$(GPIOD) tests/lint.sh

# Built anew by itself: what is counted are the lines of one compiler at one level. layers.sh looks at symbols, to which
# --coverage adds its own.
COVERAGE := CC='gcc --coverage' CFLAGS='-O1 -g' BUILD=$(BUILD)/coverage
coverage: deps-long
	@$(MAKE) --no-print-directory $(PARALLEL) $(COVERAGE) programs tests
	@$(MAKE) --no-print-directory $(COVERAGE) coverage-run
coverage-run: export PATIENCE ?= 6
coverage-run:
	@BUILD=$(BUILD) tests/coverage.sh $(UNIT) -- $(filter-out $(UNIT) $(BUILD)/asan/% tests/layers.sh,$(GATE)) -- $(LIVE)

# MUTANTS: options of tests/mutants/mutants.py.
mutants: private export MUTANTS_COMPILE = $(COMPILE)
mutants: private export MUTANTS_LINK = $(CC) $(LDFLAGS)
mutants: private export MUTANTS_LIBS = $(LIBS)
mutants: private export MUTANTS_ARCHIVES = $(ALL_A)
mutants: private export MUTANTS_WRAPS = $(foreach t,$(notdir $(UNIT)),$(addprefix $(t):,$(call wraps,$(t))))
mutants: unit programs $(BUILD)/tests/walls
	@BUILD=$(BUILD) tests/mutants/mutants.py --named
	@BUILD=$(BUILD) tests/mutants/mutants.py $(MUTANTS)

fuzz: deps-long
	@BUILD=$(BUILD) SECONDS=$(or $(SECONDS),20) tests/fuzz/run.sh

soak: programs tests
	@BUILD=$(BUILD) HOURS=$(HOURS) SECONDS=$$(($(or $(MINUTES),60) * 60)) LIMIT=$$(($(or $(MINUTES),60) * 60 + 7200)) JOBS=1 $(RUN_TESTS) \
	    tests/soak.py tests/live/test_campaign.py

bench: programs $(BENCH) $(PEER) $(SIM) $(HELPERS)
	@BUILD=$(BUILD) tests/bench/bench.py $(if $(QUICK),quick,$(if $(LONG),long))

pilot: $(BUILD)/tests/pilot_runs
	@mkdir -p $(BUILD)/pilot
	@$(BUILD)/tests/pilot_runs $(or $(SEEDS),72) $(or $(SONARD_SEED),20260101) $(BUILD)/pilot

report:
	@tests/deps.sh report
	@$(MAKE) --no-print-directory programs $(REPORT) $(PEER)
	@report/report.py --out $(BUILD)/report --build $(BUILD) $(if $(QUICK),--quick,$(if $(LONG),--long))

# One table beside rivals, in report/scores/; RELEASE=1: over seeds drawn now, once a version.
.PHONY: score
score: $(addprefix $(BUILD)/tests/,report_detection report_sectors report_recordings report_water)
	@report/score.py --build $(BUILD) $(if $(RELEASE),--release)

# ---- manual pages, installation ----

# For who reads them from the tree: sonard.conf(5) and sonard-protocol(7) have their tables from the program.
man: $(BUILD)/sonard.conf.5 $(BUILD)/sonard-protocol.7
	@echo 'man -l PAGE, of: $(MAN)'

# What clients can hold their messages against: from the table of methods.
$(BUILD)/sonard-protocol.7: docs/sonard-protocol.7.in $(BUILD)/sonard
	@echo '  GEN   $@'
	@$(RUN) $(BUILD)/sonard --man-methods < $< > $@.new
	@mv $@.new $@

$(SCHEMA): $(BUILD)/sonard
	@echo '  GEN   $@'
	@$(RUN) $(BUILD)/sonard --schema > $@.new
	@mv $@.new $@

$(BUILD)/sonard.conf.5: docs/sonard.conf.5.in $(BUILD)/sonard
	@echo '  GEN   $@'
	@$(RUN) $(BUILD)/sonard --man-table > $@.table
	@sed -e '/^@TABLE@$$/{r $@.table' -e 'd}' $< > $@
	@rm $@.table

# Every file that installation makes, as SOURCE:TARGET:MODE; uninstall takes the same ones away. Units name the programs'
# folder; UNITDIR and UDEVDIR are for packages, RUN for cross builds: what runs the programs built.
UNITDIR  ?= $(PREFIX)/lib/systemd/system
UDEVDIR  ?= $(PREFIX)/lib/udev/rules.d
LIBDIR   ?= $(PREFIX)/lib
# Where Debian's zsh looks: packages have a folder of their own.
ZSHDIR   ?= $(PREFIX)/share/zsh/$(if $(filter /usr,$(PREFIX)),vendor-completions,site-functions)
# Where Debian's python3 looks: below /usr one folder for all versions.
PYTHONDIR ?= $(PREFIX)/lib/python$(if $(filter /usr,$(PREFIX)),3,$(shell python3 -c 'import sys; print("%d.%d" % sys.version_info[:2])' 2>/dev/null))/dist-packages
UNITS    := $(filter-out $(if $(WEB),,%/sonard-web.service),$(patsubst systemd/%.in,$(BUILD)/systemd/%,$(wildcard systemd/*.service.in)))
SERVICES := sonard.socket sonard.service sonard-mavlink.service $(if $(WEB),sonard-web.service)
MAN      := docs/sonard.8 docs/sonard-mavlink.8 docs/sonarctl.1 $(BUILD)/sonard.conf.5 $(BUILD)/sonard-protocol.7 docs/libsonard.3 \
            docs/sonard-tune.1 docs/sonard-report.1 docs/sonard-import.1 docs/sonard-poses.1 docs/sonard-rosbag.1 $(if $(WEB),docs/sonard-web.8)
GUIDES   := NEWS README.md $(wildcard docs/*.md)
# Guides name these by their places below docs/.
PAPERS   := $(wildcard docs/devices/*.md docs/pictures/*)
SCENES   := $(wildcard config/scenes/*.conf)
EXAMPLES := $(wildcard examples/*.c examples/*.py examples/archive/*) $(if $(WEB),$(wildcard examples/prometheus/*))
MODULE   := $(wildcard python/sonard/*.py) python/sonard/py.typed
OPTIONED := sonard sonard-import sonard-mavlink sonard-poses sonard-report sonard-rosbag sonard-tune $(if $(WEB),sonard-web)
PAGE     := page.py page.html style.gp capture_answers.gp
SHARED   := config/sonard.conf systemd/network.conf $(SCHEMA)
FILES     = $(BUILD)/sonard:$(PREFIX)/sbin/sonard:755 $(BUILD)/sonarctl:$(PREFIX)/bin/sonarctl:755 \
            $(BUILD)/sonard-mavlink:$(PREFIX)/sbin/sonard-mavlink:755 python/sonard-tune:$(PREFIX)/bin/sonard-tune:755 \
            python/sonard-report:$(PREFIX)/bin/sonard-report:755 python/sonard-poses:$(PREFIX)/bin/sonard-poses:755 \
            python/sonard-rosbag:$(PREFIX)/bin/sonard-rosbag:755 python/sonard-import:$(PREFIX)/bin/sonard-import:755 \
            python/mcap_file.py:$(PREFIX)/share/sonard-tools/mcap_file.py:644 \
            python/sonard_tool.py:$(PREFIX)/share/sonard-tools/sonard_tool.py:644 VERSION:$(PREFIX)/share/sonard-tools/VERSION:644 \
            $(if $(WEB),$(BUILD)/sonard-web:$(PREFIX)/sbin/sonard-web:755) \
            $(foreach p,$(PAGE),report/$(p):$(PREFIX)/share/sonard-report/$(p):644) \
            $(foreach m,$(MAN),$(m):$(PREFIX)/share/man/man$(subst .,,$(suffix $(m)))/$(notdir $(m)):644) \
            $(foreach u,$(UNITS) systemd/sonard.socket,$(u):$(UNITDIR)/$(notdir $(u)):644) \
            $(LIBRARY):$(LIBDIR)/$(notdir $(LIBRARY)):644 client/lib/sonard.h:$(PREFIX)/include/sonard.h:644 \
            $(BUILD)/libsonard.pc:$(LIBDIR)/pkgconfig/libsonard.pc:644 \
            $(foreach m,$(MODULE),$(m):$(PYTHONDIR)/$(m:python/%=%):644) \
            completion/sonarctl.bash:$(PREFIX)/share/bash-completion/completions/sonarctl:644 \
            completion/_sonarctl:$(ZSHDIR)/_sonarctl:644 completion/_sonard:$(ZSHDIR)/_sonard:644 \
            $(foreach p,$(OPTIONED),completion/options.bash:$(PREFIX)/share/bash-completion/completions/$(p):644) \
            $(foreach e,$(EXAMPLES),$(e):$(PREFIX)/share/doc/sonard/$(e):644) \
            systemd/sysusers.conf:$(PREFIX)/lib/sysusers.d/sonard.conf:644 \
            systemd/tmpfiles.conf:$(PREFIX)/lib/tmpfiles.d/sonard.conf:644 \
            systemd/modules-load.conf:$(PREFIX)/lib/modules-load.d/sonard.conf:644 \
            systemd/udev.rules:$(UDEVDIR)/91-sonard.rules:644 \
            $(foreach s,$(SHARED),$(s):$(PREFIX)/share/sonard/$(notdir $(s)):644) \
            $(foreach g,$(GUIDES),$(g):$(PREFIX)/share/doc/sonard/$(notdir $(g)):644) \
            $(foreach p,$(PAPERS),$(p):$(PREFIX)/share/doc/sonard/$(p:docs/%=%):644) \
            $(foreach s,$(SCENES),$(s):$(PREFIX)/share/sonard/scenes/$(notdir $(s)):644)
field     = $(word $(1),$(subst :, ,$(2)))

# With the folders in them; whole at any time, so that two that install at once need not know of each other.
$(BUILD)/folders.stamp: FORCE
	$(call keep,$(PREFIX) $(LIBDIR) $(VERSION))
filled    = @mkdir -p $(@D); sed 's|@SBINDIR@|$(PREFIX)/sbin|; s|@PREFIX@|$(PREFIX)|; s|@LIBDIR@|$(LIBDIR)|; s|@VERSION@|$(VERSION)|' $< > $@.$$$$ && mv $@.$$$$ $@
$(BUILD)/systemd/%: systemd/%.in $(BUILD)/folders.stamp
	$(filled)
$(BUILD)/libsonard.pc: client/lib/libsonard.pc.in $(BUILD)/folders.stamp
	$(filled)

install: programs $(BUILD)/sonard.conf.5 $(BUILD)/sonard-protocol.7 $(SCHEMA)
	@$(MAKE) --no-print-directory install-built

# What was built, and nothing is built anew: for tests, beside which others run the programs.
install-built: $(UNITS) $(BUILD)/libsonard.pc
	@$(foreach f,$(FILES),install -D -m $(call field,3,$(f)) $(call field,1,$(f)) $(DESTDIR)$(call field,2,$(f)) &&) true
	@ln -sf $(notdir $(LIBRARY)) $(DESTDIR)$(LIBDIR)/libsonard.so
	@install -d $(DESTDIR)/etc/sonard/sonard.conf.d
	@test -e $(DESTDIR)/etc/sonard/sonard.conf || install -m 644 config/sonard.conf $(DESTDIR)/etc/sonard/sonard.conf
	@test -e $(DESTDIR)/etc/default/sonard-mavlink || install -D -m 644 systemd/sonard-mavlink.default $(DESTDIR)/etc/default/sonard-mavlink
	@echo 'installed below $(DESTDIR)$(PREFIX); on a running system now: ldconfig; systemd-sysusers; systemd-tmpfiles --create;'
	@echo 'udevadm control --reload; systemctl daemon-reload; systemctl enable --now sonard'

# The configuration stays, and what sonard has written.
# A service whose files are gone would go on running, and its links would lead nowhere.
uninstall:
	-@test -n '$(DESTDIR)' || ! command -v systemctl > /dev/null || systemctl disable --now $(SERVICES)
	@test -n '$(DESTDIR)' || ! command -v systemctl > /dev/null || systemctl stop 'sonard-replay@*.service'
	rm -f $(foreach f,$(FILES),$(DESTDIR)$(call field,2,$(f))) $(DESTDIR)$(LIBDIR)/libsonard.so
	-@rmdir $(DESTDIR)$(PYTHONDIR)/sonard $(addprefix $(DESTDIR)$(PREFIX)/share/doc/sonard/,examples/prometheus examples/archive examples devices pictures) $(DESTDIR)$(PREFIX)/share/sonard/scenes $(DESTDIR)$(PREFIX)/share/doc/sonard $(DESTDIR)$(PREFIX)/share/sonard $(DESTDIR)$(PREFIX)/share/sonard-report $(DESTDIR)$(PREFIX)/share/sonard-tools

clean:
	rm -rf $(BUILD) demo

-include $(shell find $(BUILD) -path $(BUILD)/vm -prune -o -type f -name '*.d' -print 2>/dev/null)
