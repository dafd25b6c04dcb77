# SPDX-License-Identifier: MIT
# sonard - see README.md. `make help` lists the targets.
#
# Every .c below a folder belongs to that folder's archive; tests/unit/test_X.c, tests/fuzz/fuzz_X.c,
# tests/bench/bench_X.c and tests/sim/X.c are one program each. BUILD=dir and SAN=address,undefined make other builds beside.

CC       ?= cc
PKG_CONFIG ?= pkg-config
BUILD    ?= build
VERSION  := $(shell cat VERSION 2>/dev/null || echo 0)
SAN      ?=
PREFIX   ?= /usr/local

WARN     := -Wall -Wextra -Wconversion -Wshadow -Wstrict-prototypes -Werror
# -ffp-contract=off: the same bits on every CPU. -fno-math-errno: lets sqrt be an instruction. -fno-trapping-math: lets
# choices between floats be vectors; it changes no value.
CFLAGS   ?= -O2 -g
ALLCFLAGS = -std=c17 $(WARN) $(CPPFLAGS) $(CFLAGS) -ffp-contract=off -fno-math-errno -fno-trapping-math -fPIE -fstack-protector-strong \
            -ffile-prefix-map=$(CURDIR)=. -D_GNU_SOURCE -DSONARD_VERSION='"$(VERSION)"' -MMD -MP \
            $(if $(SAN),-fsanitize=$(SAN) -fno-omit-frame-pointer -fno-sanitize-recover=all)
# libgpiod 1 and 2 are different libraries of one name; without any there are no GPIO lines.
GPIOD    := $(or $(firstword $(subst ., ,$(shell $(PKG_CONFIG) --modversion libgpiod 2>/dev/null))),0)
ALLCFLAGS += -DSONARD_GPIOD=$(GPIOD) $(if $(filter-out 0,$(GPIOD)),$(shell $(PKG_CONFIG) --cflags libgpiod))
LDFLAGS  += -pie -Wl,-z,relro,-z,now $(if $(SAN),-fsanitize=$(SAN))

SRC      := $(wildcard grid/*.c grid/*/*.c drivers/*.c daemon/*.c config/*.c client/*.c)
obj       = $(patsubst %.c,$(BUILD)/%.o,$(1))
GRID     := $(BUILD)/libgrid.a
DRIVERS  := $(BUILD)/libdrivers.a
CONFIG   := $(BUILD)/libconfig.a
DAEMON   := $(BUILD)/libdaemon.a
CLIENT   := $(BUILD)/libclient.a
SIMLIB   := $(BUILD)/libsim.a
SEALIB   := $(BUILD)/libsea.a
ALL_A    := $(SEALIB) $(SIMLIB) $(CLIENT) $(DAEMON) $(CONFIG) $(DRIVERS) $(GRID)
LIBS     := $(if $(filter-out 0,$(GPIOD)),$(shell $(PKG_CONFIG) --libs libgpiod)) -lmodbus -linih -ljansson -llz4 -lzstd -lz -lm -pthread

PROGRAMS := $(BUILD)/sonard $(BUILD)/sonarctl $(BUILD)/sonard-mavlink
LIBRARY  := $(BUILD)/libsonard.so.0
UNIT     := $(patsubst tests/unit/%.c,$(BUILD)/tests/%,$(wildcard tests/unit/test_*.c))
SIM      := $(patsubst tests/sim/%.c,$(BUILD)/tests/%,$(wildcard tests/sim/*.c))
BENCH    := $(patsubst tests/bench/%.c,$(BUILD)/tests/%,$(wildcard tests/bench/bench_*.c))
REPORT   := $(patsubst tests/report/%.c,$(BUILD)/tests/%,$(wildcard tests/report/report_*.c))
# A peer to measure against, where Debian's liboctomap-dev is installed.
OCTOMAP  := $(wildcard /usr/include/octomap/octomap.h)
PEER     := $(if $(OCTOMAP),$(BUILD)/tests/bench_octomap_peer)
HELPERS  := $(patsubst tests/tools/%.c,$(BUILD)/tests/%,$(wildcard tests/tools/*.c))
TOOLS    := $(patsubst tests/lib/%.c,$(BUILD)/tests/%.so,$(wildcard tests/lib/*.c))

.PHONY: all help deps deps-check clean programs unit tests suite demo check check-san check-vm check-arm64 check-deb deb layers coverage fuzz bench report man install uninstall
all: programs

programs: $(PROGRAMS) $(LIBRARY)
	@:
unit: $(UNIT)
tests: $(UNIT) $(SIM) $(BENCH) $(REPORT) $(HELPERS) $(TOOLS)

$(GRID):    $(call obj,$(wildcard grid/*.c grid/*/*.c))
$(DRIVERS): $(call obj,$(wildcard drivers/*.c))
$(CONFIG):  $(call obj,$(wildcard config/*.c))
$(DAEMON):  $(call obj,$(filter-out daemon/main.c,$(wildcard daemon/*.c)))
$(CLIENT):  $(call obj,$(filter-out client/sonarctl.c client/sonard-mavlink.c,$(wildcard client/*.c)))
$(SIMLIB):  $(call obj,$(wildcard tests/sim/lib/*.c))
$(SEALIB):  $(call obj,$(wildcard tests/report/lib/*.c))
$(BUILD)/%.a:
	@mkdir -p $(@D)
	@rm -f $@
	@$(AR) rcsD $@ $^

$(BUILD)/%.o: %.c
	@mkdir -p $(@D)
	@echo '  CC    $<'
	@$(CC) $(ALLCFLAGS) -c -o $@ $<

$(BUILD)/sonard: $(BUILD)/daemon/main.o $(DAEMON) $(CONFIG) $(DRIVERS) $(GRID)
	@mkdir -p $(@D)
	@echo '  LD    $@'
	@$(CC) $(LDFLAGS) -o $@ $^ $(LIBS)
$(BUILD)/sonarctl: $(BUILD)/client/sonarctl.o $(CLIENT) $(CONFIG) $(DRIVERS)
	@mkdir -p $(@D)
	@echo '  LD    $@'
	@$(CC) $(LDFLAGS) -o $@ $^ $(LIBS)

$(BUILD)/sonard-mavlink: $(BUILD)/client/sonard-mavlink.o $(CLIENT) $(CONFIG)
	@mkdir -p $(@D)
	@echo '  LD    $@'
	@$(CC) $(LDFLAGS) -o $@ $^ $(LIBS)

# For other people's programs; ours have the same objects linked in.
$(BUILD)/%.pic.o: %.c
	@mkdir -p $(@D)
	@echo '  CC    $< (shared)'
	@$(CC) $(ALLCFLAGS) -fPIC -c -o $@ $<
$(LIBRARY): $(BUILD)/client/sonard_client.pic.o $(BUILD)/client/sonard_answers.pic.o client/libsonard.map
	@echo '  LD    $@'
	@$(CC) -shared -Wl,-soname,$(@F) -Wl,--version-script,$(filter %.map,$^) $(filter-out -pie,$(LDFLAGS)) -o $@ $(filter %.o,$^) -ljansson

# Test programs may look everywhere. Static patterns: as implicit rules these would match their own prerequisites.
$(UNIT): $(BUILD)/tests/%: $(BUILD)/tests/unit/%.o $(ALL_A)
	@mkdir -p $(@D)
	@echo '  LD    $@'
	@$(CC) $(LDFLAGS) -o $@ $^ $(LIBS)
$(BUILD)/tests/test_template: LDFLAGS += -Wl,--wrap=malloc,--wrap=calloc
$(BUILD)/tests/test_sim_program: | $(BUILD)/tests/ping360_sim
$(SIM): $(BUILD)/tests/%: $(BUILD)/tests/sim/%.o $(SIMLIB) $(DRIVERS) $(GRID)
	@mkdir -p $(@D)
	@echo '  LD    $@'
	@$(CC) $(LDFLAGS) -o $@ $^ $(LIBS)
$(BENCH): $(BUILD)/tests/%: $(BUILD)/tests/bench/%.o $(ALL_A)
	@mkdir -p $(@D)
	@echo '  LD    $@'
	@$(CC) $(LDFLAGS) -o $@ $^ $(LIBS)
$(REPORT): $(BUILD)/tests/%: $(BUILD)/tests/report/%.o $(ALL_A)
	@mkdir -p $(@D)
	@echo '  LD    $@'
	@$(CC) $(LDFLAGS) -o $@ $^ $(LIBS)
$(BUILD)/tests/report_water: $(BUILD)/tests/report/peer_$(if $(OCTOMAP),octomap,none).o
$(BUILD)/tests/report_water: LIBS += $(if $(OCTOMAP),-loctomap -loctomath -lstdc++)
$(BUILD)/tests/report/peer_octomap.o: tests/report/peer_octomap.cc tests/report/peer.h
	@mkdir -p $(@D)
	@echo '  CXX   $<'
	@$(CXX) -std=c++17 -Wall -Wextra -O2 -c -o $@ $<
$(BUILD)/tests/bench_octomap_peer: tests/bench/octomap_peer.cc tests/bench/voxel_scene.h $(GRID)
	@mkdir -p $(@D)
	@echo '  CXX   $@'
	@$(CXX) -std=c++17 -Wall -Wextra $(CFLAGS) -o $@ $< $(GRID) -loctomap -loctomath
$(HELPERS): $(BUILD)/tests/%: $(BUILD)/tests/tools/%.o $(CLIENT) $(GRID)
	@mkdir -p $(@D)
	@echo '  LD    $@'
	@$(CC) $(LDFLAGS) -o $@ $^ $(LIBS)
$(TOOLS): $(BUILD)/tests/%.so: tests/lib/%.c
	@mkdir -p $(@D)
	@$(CC) -shared -fPIC -O2 -D_GNU_SOURCE -o $@ $< -ldl

# ---- what a person types ----

help:
	@echo 'make            build sonard, sonarctl and sonard-mavlink into $(BUILD)/'
	@echo 'make demo       install what is missing, build, replay a real recording, print its sectors, draw them'
	@echo 'make check      install what is missing, build with gcc and clang, run every test'
	@echo 'make check-san  the tests under address+undefined and under thread sanitizer'
	@echo 'make check-vm   what needs a kernel with CAN and GPIO, and the service under systemd, in virtual machines'
	@echo 'make check-arm64 the unit tests and a replay for arm64, under qemu-user'
	@echo 'make check-deb  the Debian package, for amd64 and arm64, twice the same, clean for lintian'
	@echo 'make deb        the Debian package'
	@echo 'make coverage   which lines of grid/ and of the parsers the unit tests reach'
	@echo 'make fuzz       run every fuzz target for SECONDS (20) each'
	@echo 'make bench      measure: scaling, ratios, every part by itself; $(BUILD)/bench.json (QUICK=1: shorter, LONG=1: all sizes)'
	@echo 'make report     error against run time, measured: report/index.html, in minutes (QUICK=1: seconds, LONG=1: with a billion updates)'
	@echo 'make man        the manual pages for man -l, also sonard.conf(5), whose keys are those of the program'
	@echo 'make layers     who may include whom'
	@echo 'make install    programs, manual pages, configuration and services below DESTDIR$(PREFIX); make uninstall'

deps:
	@tests/deps.sh build
deps-check:
	@tests/deps.sh check

demo: deps
	@$(MAKE) --no-print-directory programs $(BUILD)/tests/walls
	@BUILD=$(BUILD) tests/demo.sh

SCRIPTS := $(wildcard tests/replay/*.sh tests/live/test_*.py)
CHECKS  := tests/layers.sh tests/unused.sh tests/service.sh tests/valgrind.sh tests/model/run.sh tests/mcap/check.sh tests/mavlink/check.sh tests/gpiod2.sh tests/report/check.py tests/bench/plan_error.py

# Everything that one build can be tested with.
suite: programs tests
	@BUILD=$(BUILD) SAN=$(SAN) LIMIT=$(if $(SAN),900,300) tests/run.sh $(SCRIPTS) $(UNIT)

check: deps-check
	@$(MAKE) --no-print-directory CC=gcc programs tests
	@$(MAKE) --no-print-directory CC=clang BUILD=$(BUILD)/clang programs tests
	@BUILD=$(BUILD) tests/run.sh $(CHECKS) $(SCRIPTS) $(UNIT) $(UNIT:$(BUILD)/%=$(BUILD)/clang/%)

# What has one thread has nothing for the thread sanitizer.
THREADED := $(patsubst tests/unit/%.c,%,$(shell grep -lE 'daemon/|pthread' tests/unit/*.c))

check-san: deps-check
	@$(MAKE) --no-print-directory CC=gcc SAN=address,undefined BUILD=$(BUILD)/asan suite
	@$(MAKE) --no-print-directory CC=clang SAN=thread BUILD=$(BUILD)/tsan UNIT='$(THREADED:%=$(BUILD)/tsan/tests/%)' suite

check-vm:
	@tests/deps.sh vm
	@$(MAKE) --no-print-directory programs tests
	@BUILD=$(BUILD) tests/vm/run.sh
	@BUILD=$(BUILD) tests/vm/run.sh --systemd

check-arm64:
	@tests/deps.sh arm64
	@$(MAKE) --no-print-directory programs
	@BUILD=$(BUILD) LIMIT=3600 tests/run.sh tests/arm64.sh

check-deb:
	@tests/deps.sh deb
	@BUILD=$(BUILD) LIMIT=1800 tests/run.sh tests/deb.sh

# The package for this machine, from this tree, into BUILD/deb; debian/control names what that needs.
deb:
	@rm -rf $(BUILD)/deb && mkdir -p $(BUILD)/deb/sonard
	@git ls-files -z | xargs -0 cp --parents -t $(BUILD)/deb/sonard
	@cd $(BUILD)/deb/sonard && dpkg-buildpackage -us -uc -b
	@ls $(BUILD)/deb/*.deb

layers: $(GRID)
	@BUILD=$(BUILD) tests/layers.sh

# Built anew by itself: what is counted are the lines of one compiler at one level.
coverage: deps-check
	@$(MAKE) --no-print-directory CC='gcc --coverage' CFLAGS='-O1 -g' BUILD=$(BUILD)/coverage unit $(BUILD)/coverage/tests/ping360_sim
	@BUILD=$(BUILD)/coverage tests/coverage.sh $(patsubst $(BUILD)/%,$(BUILD)/coverage/%,$(UNIT))

fuzz: deps-check
	@BUILD=$(BUILD) SECONDS=$(or $(SECONDS),20) tests/fuzz/run.sh

bench: programs $(BENCH) $(PEER) $(SIM) $(HELPERS)
	@BUILD=$(BUILD) tests/bench/bench.py $(if $(QUICK),quick,$(if $(LONG),long))

report:
	@tests/deps.sh report
	@$(MAKE) --no-print-directory programs $(REPORT) $(PEER)
	@tests/report/report.py --build $(BUILD) $(if $(QUICK),--quick,$(if $(LONG),--long))

# ---- manual pages, installation ----

# For who reads them from the tree: sonard.conf(5) has its table of keys from the program.
man: $(BUILD)/sonard.conf.5
	@echo 'man -l PAGE, of: $(MAN)'

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
UNITS    := $(patsubst systemd/%.in,$(BUILD)/systemd/%,$(wildcard systemd/*.service.in))
MAN      := docs/sonard.8 docs/sonard-mavlink.8 docs/sonarctl.1 $(BUILD)/sonard.conf.5 docs/sonard-protocol.7 docs/libsonard.3 \
            docs/sonard-tune.1 docs/sonard-report.1
GUIDES   := NEWS README.md $(wildcard docs/*.md)
# Guides name these by their places below docs/.
PAPERS   := $(wildcard docs/devices/*.md docs/pictures/*)
SCENES   := $(wildcard config/scenes/*.conf)
EXAMPLES := $(wildcard examples/autopilot.*)
PAGE     := page.py page.html style.gp capture_answers.gp
SHARED   := config/sonard.conf systemd/network.conf docs/sonard-protocol.schema.json
FILES     = $(BUILD)/sonard:$(PREFIX)/sbin/sonard:755 $(BUILD)/sonarctl:$(PREFIX)/bin/sonarctl:755 \
            $(BUILD)/sonard-mavlink:$(PREFIX)/sbin/sonard-mavlink:755 python/sonard-tune:$(PREFIX)/bin/sonard-tune:755 \
            python/sonard-report:$(PREFIX)/bin/sonard-report:755 \
            $(foreach p,$(PAGE),tests/report/$(p):$(PREFIX)/share/sonard-report/$(p):644) \
            $(foreach m,$(MAN),$(m):$(PREFIX)/share/man/man$(subst .,,$(suffix $(m)))/$(notdir $(m)):644) \
            $(foreach u,$(UNITS) systemd/sonard.socket,$(u):$(UNITDIR)/$(notdir $(u)):644) \
            $(LIBRARY):$(LIBDIR)/$(notdir $(LIBRARY)):644 client/sonard.h:$(PREFIX)/include/sonard.h:644 \
            $(BUILD)/libsonard.pc:$(LIBDIR)/pkgconfig/libsonard.pc:644 python/sonard.py:$(PYTHONDIR)/sonard.py:644 \
            completion/sonarctl.bash:$(PREFIX)/share/bash-completion/completions/sonarctl:644 \
            completion/_sonarctl:$(ZSHDIR)/_sonarctl:644 \
            $(foreach e,$(EXAMPLES),$(e):$(PREFIX)/share/doc/sonard/examples/$(notdir $(e)):644) \
            systemd/sysusers.conf:$(PREFIX)/lib/sysusers.d/sonard.conf:644 \
            systemd/tmpfiles.conf:$(PREFIX)/lib/tmpfiles.d/sonard.conf:644 \
            systemd/modules-load.conf:$(PREFIX)/lib/modules-load.d/sonard.conf:644 \
            systemd/udev.rules:$(UDEVDIR)/70-sonard.rules:644 \
            $(foreach s,$(SHARED),$(s):$(PREFIX)/share/sonard/$(notdir $(s)):644) \
            $(foreach g,$(GUIDES),$(g):$(PREFIX)/share/doc/sonard/$(notdir $(g)):644) \
            $(foreach p,$(PAPERS),$(p):$(PREFIX)/share/doc/sonard/$(p:docs/%=%):644) \
            $(foreach s,$(SCENES),$(s):$(PREFIX)/share/sonard/scenes/$(notdir $(s)):644)
field     = $(word $(1),$(subst :, ,$(2)))

$(BUILD)/systemd/%: systemd/%.in Makefile
	@mkdir -p $(@D)
	@sed 's|@SBINDIR@|$(PREFIX)/sbin|' $< > $@

$(BUILD)/libsonard.pc: client/libsonard.pc.in Makefile
	@sed 's|@PREFIX@|$(PREFIX)|; s|@LIBDIR@|$(LIBDIR)|; s|@VERSION@|$(VERSION)|' $< > $@

install: programs $(BUILD)/sonard.conf.5
	@rm -rf $(BUILD)/systemd $(BUILD)/libsonard.pc
	@$(MAKE) --no-print-directory $(UNITS) $(BUILD)/libsonard.pc
	@$(foreach f,$(FILES),install -D -m $(call field,3,$(f)) $(call field,1,$(f)) $(DESTDIR)$(call field,2,$(f)) &&) true
	@ln -sf $(notdir $(LIBRARY)) $(DESTDIR)$(LIBDIR)/libsonard.so
	@install -d $(DESTDIR)/etc/sonard/sonard.conf.d
	@test -e $(DESTDIR)/etc/sonard/sonard.conf || install -m 644 config/sonard.conf $(DESTDIR)/etc/sonard/sonard.conf
	@echo 'installed below $(DESTDIR)$(PREFIX); on a running system now: ldconfig; systemd-sysusers; systemd-tmpfiles --create;'
	@echo 'udevadm control --reload; systemctl daemon-reload; systemctl enable --now sonard'

# The configuration stays, and what sonard has written.
uninstall:
	rm -f $(foreach f,$(FILES),$(DESTDIR)$(call field,2,$(f))) $(DESTDIR)$(LIBDIR)/libsonard.so
	-@rmdir $(addprefix $(DESTDIR)$(PREFIX)/share/doc/sonard/,examples devices pictures) $(DESTDIR)$(PREFIX)/share/sonard/scenes $(DESTDIR)$(PREFIX)/share/doc/sonard $(DESTDIR)$(PREFIX)/share/sonard $(DESTDIR)$(PREFIX)/share/sonard-report

clean:
	rm -rf $(BUILD) demo report

-include $(shell find $(BUILD) -path $(BUILD)/vm -prune -o -type f -name '*.d' -print 2>/dev/null)
