// A design that Verilator has written, for the loops of `loops.h`, which comes below. What depends on
// the design is above: INPUTS and OUTPUTS as lists of X(port); for waveforms VCD and HALF a period in
// nanoseconds; COVERAGE, if it is counted. The class of the design is Vfresa.

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <vector>

#ifdef VCD
#include <verilated_vcd_c.h>
#endif
#ifdef COVERAGE
#include <verilated_cov.h>
#endif

namespace {

// Verilator has a port in the least of four sizes that holds it.
struct Pad {
	const void *data;
	size_t size;
	uint64_t get() const {
		switch (size) {
		case 1: return *static_cast<const uint8_t *>(data);
		case 2: return *static_cast<const uint16_t *>(data);
		case 4: return *static_cast<const uint32_t *>(data);
		default: return *static_cast<const uint64_t *>(data);
		}
	}
};

struct Pin {
	void *data;
	size_t size;
	void set(uint64_t bits) const {
		switch (size) {
		case 1: *static_cast<uint8_t *>(data) = uint8_t(bits); break;
		case 2: *static_cast<uint16_t *>(data) = uint16_t(bits); break;
		case 4: *static_cast<uint32_t *>(data) = uint32_t(bits); break;
		default: *static_cast<uint64_t *>(data) = bits;
		}
	}
};

struct Engine {
	VerilatedContext context;
	std::unique_ptr<Vfresa> design;
	std::vector<Pin> pins;
	std::vector<Pad> pads;
	bool settled = false;
#ifdef VCD
	VerilatedVcdC vcd;
	uint64_t time = 0;
#endif

	// What has no value at power-up gets the same random one in every run, so that it is not taken for 0.
	Engine() {
		context.randReset(2);
		context.randSeed(1);
#ifdef VCD
		context.traceEverOn(true);
#endif
		design = std::make_unique<Vfresa>(&context, "");
		design->clk = 0;
#define X(port) pins.push_back({&design->port, sizeof(design->port)}); design->port = 0;
		INPUTS
#undef X
#define X(port) pads.push_back({&design->port, sizeof(design->port)});
		OUTPUTS
#undef X
	}

	void put(size_t port, uint64_t bits) {
		pins[port].set(bits);
		settled = false;
	}

	void settle() {
		if (!settled)
			design->eval();
		settled = true;
	}

	void edge() {
		settle();
		sample();
		design->clk = 1;
		design->eval();
		sample();
		design->clk = 0;
		design->eval();
	}

	int64_t advance(int64_t, const std::vector<int32_t> &) {
		edge();
		return 1;
	}

#ifdef VCD
	void sample() {
		vcd.dump(time);
		time += HALF;
	}
#else
	void sample() {}
#endif

	~Engine() {
#ifdef VCD
		if (vcd.isOpen()) {
			settle();
			sample();
			vcd.close();
		}
#endif
		design->final();
	}
};

}  // namespace

#define API extern "C" __attribute__((visibility("default")))

API Engine *fresa_new(const char *path) {
	auto engine = new Engine;
#ifdef VCD
	engine->design->trace(&engine->vcd, 99);
	engine->vcd.set_time_unit("1ns");
	engine->vcd.set_time_resolution("1ns");
	engine->vcd.open(path);
	if (!engine->vcd.isOpen()) {
		delete engine;
		return nullptr;
	}
#else
	(void)path;
#endif
	return engine;
}

#ifdef COVERAGE
API void fresa_coverage(Engine *engine, const char *path) { engine->context.coveragep()->write(path); }
#endif
