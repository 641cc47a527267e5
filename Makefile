# The two commands a new machine needs are in the README; everything CI runs is `make test`.

CARGO ?= cargo
SUDO := $(shell [ "$$(id -u)" = 0 ] || echo sudo)
DENY_VERSION := 0.20.2
DEBIAN_PACKAGES := ffmpeg nodejs npm chromium
export RUSTDOCFLAGS := -D warnings
TARGET := $(or $(CARGO_TARGET_DIR),target)
# Packages from npm, as the lock file has them; nothing is done where they are there already.
NPM_CI = [ node_modules/.package-lock.json -nt package-lock.json ] || npm ci --no-audit --no-fund
# Where the browser test leaves what it saw.
export MUYBRIDGE_SHOTS ?= $(abspath $(TARGET))/studio-screenshots

.PHONY: test tools page studio lint unit deny demo browser bench clean

test: tools page lint unit deny demo browser

# Programs the tests call: ffmpeg (video input) and the Khronos glTF validator (npm, pinned by
# package-lock.json), cargo-deny. Installed only where missing.
tools:
	@missing=""; for p in $(DEBIAN_PACKAGES); do \
	  case $$p in nodejs) c=node;; *) c=$$p;; esac; \
	  command -v $$c >/dev/null 2>&1 || missing="$$missing $$p"; done; \
	if [ -n "$$missing" ]; then \
	  $(SUDO) apt-get update -qq && $(SUDO) apt-get install -y -qq --no-install-recommends $$missing; fi
	cd tests/validator && { $(NPM_CI); }
	@$(CARGO) deny --version 2>/dev/null | grep -q '$(DENY_VERSION)' || \
	  $(CARGO) install --locked --quiet --debug cargo-deny --version $(DENY_VERSION)

# The studio's page, which the program embeds.
page:
	cd studio && { $(NPM_CI); } && npm run build

studio: page
	$(CARGO) build --locked --release --features studio

lint:
	$(CARGO) fmt --check
	$(CARGO) clippy --locked --all-targets --features studio -- -D warnings
	$(CARGO) doc --locked --no-deps --features studio --quiet

unit:
	MUYBRIDGE_REQUIRE_TOOLS=1 $(CARGO) test --locked --features studio

deny:
	$(CARGO) deny --locked check bans licenses sources

# The main job with the release build, as a new user runs it.
demo:
	d=$$(mktemp -d) && $(CARGO) run --locked --release --quiet -- -q demo --out $$d/demo && rm -r $$d

# The studio from an empty folder to an exported rig, and the demo's report, in headless Chromium.
browser:
	cd tests/browser && { $(NPM_CI); }
	$(CARGO) build --locked --features studio
	MUYBRIDGE_BIN=$(TARGET)/debug/muybridge node tests/browser/studio.mjs
	d=$$(mktemp -d) && $(TARGET)/debug/muybridge -q demo --out $$d/demo && \
	  node tests/browser/report.mjs $$d/demo/report.html --screenshots $(MUYBRIDGE_SHOTS)/report && rm -r $$d

# Every figure of docs/performance.md. With PEERS=folder also the ratios to the Python peers in it, with
# CLIP="file x,y,w,h x,y,w,h" (foreground, background) also that of a video to ffmpeg's null decode.
bench:
	$(CARGO) bench --locked --bench gram --bench keys --bench masks --bench max_flow
	RAYON_NUM_THREADS=1 $(CARGO) bench --locked --bench gram --bench keys
	[ -z "$(CLIP)" ] || { $(CARGO) build --locked --release && python3 benches/video_beside.py target/release/muybridge $(CLIP); }
	[ -z "$(PEERS)" ] || { $(CARGO) bench --locked --no-run --bench beside_peers && python3 benches/side_by_side.py $(PEERS); }

clean:
	$(CARGO) clean
