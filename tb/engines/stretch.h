// Values over a stretch of clocks, so that a design's logic, as `write_cxxrtl` has written it, is evaluated
// for many clocks at once. A value is `base + n * delta` in clock n of the stretch, without wrapping round,
// for all clocks before the `horizon`; what is no such line, for clock 0 alone, is UNKNOWN from then on.
// Operations keep that true: where a carry, the wrap of a counter or the outcome of a comparison changes
// with n, they bring the horizon nearer. So if the next values of all registers are found to be their
// values and their delta once more, that is proved, by induction, for every clock before the horizon.

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <initializer_list>

namespace stretch {

using wide_int = __int128;

constexpr int64_t UNKNOWN = INT64_MIN;

// The fast model, which a library that is loaded later can use for so little.
__attribute__((tls_model("initial-exec"))) inline thread_local int64_t horizon;

inline void limit(wide_int clocks) {
	if (clocks < horizon)
		horizon = int64_t(clocks);
}

// Not inline: calls cost less than their compilation, since a stretch is long, and tried seldom.
#define STRETCH_CALLED __attribute__((noinline))

// Ends the stretch before base + n * delta leaves what is from low to below high.
STRETCH_CALLED inline void keep(wide_int base, wide_int delta, wide_int low, wide_int high) {
	if (delta > 0)
		limit((high - 1 - base) / delta + 1);
	else if (delta < 0)
		limit((base - low) / -delta + 1);
}

// Ends it before base + n * delta, at first not 0, is 0; at once, if it is 0 and moves.
STRETCH_CALLED inline void keep_zeroness(wide_int base, wide_int delta) {
	if (delta == 0)
		return;
	if (base == 0)
		limit(1);
	else if ((base < 0) != (delta < 0) && base % delta == 0)
		limit(-(base / delta));
}

struct line {
	wide_int base, delta;
};

// Brings a line into range, as N bits are; gives back its base, and its delta if that fits.
STRETCH_CALLED inline uint64_t wrap(line l, size_t bits, int64_t &delta) {
	wide_int low = l.base >> bits << bits;
	keep(l.base, l.delta, low, low + (wide_int(1) << bits));
	delta = int64_t(l.delta) == l.delta ? int64_t(l.delta) : UNKNOWN;
	return uint64_t(l.base - low);
}

constexpr uint64_t ones(size_t bits) { return bits >= 64 ? ~uint64_t(0) : (uint64_t(1) << bits) - 1; }

template<size_t N, size_t Stop, size_t Start> struct part;

template<size_t N> struct value {
	static constexpr size_t bits = N;
	static constexpr size_t words = N ? (N + 63) / 64 : 1;
	uint64_t word[words] = {};
	int64_t delta = 0;

	value() = default;

	// CXXRTL gives 32 bits a number.
	explicit value(std::initializer_list<uint32_t> chunks) {
		size_t n = 0;
		for (auto chunk : chunks) {
			word[n / 2] |= uint64_t(chunk) << n % 2 * 32;
			n++;
		}
	}

	static value unknown() {
		value result;
		result.delta = UNKNOWN;
		return result;
	}

	static value of(uint64_t bits) {
		value result;
		result.word[0] = bits & ones(N);
		return result;
	}

	static value of(line l) {
		value result;
		result.word[0] = wrap(l, N, result.delta);
		return result;
	}

	bool moves() const { return delta != 0; }

	STRETCH_CALLED explicit operator bool() const {
		bool any = false;
		for (auto each : word)
			any |= each != 0;
		if (moves()) {
			if (delta == UNKNOWN || words > 1)
				limit(1);
			else
				keep_zeroness(word[0], delta);
		}
		return any;
	}

	bool operator!() const { return !bool(*this); }

	uint64_t unsigned_bits() const { return word[0]; }
	int64_t signed_bits() const { return N ? int64_t(word[0] << (64 - N)) >> (64 - N) : 0; }
	line unsigned_line() const { return {wide_int(word[0]), delta}; }

	line signed_line() const {
		wide_int base = signed_bits(), half = wide_int(1) << (N - 1);
		base < 0 ? keep(base, delta, -half, 0) : keep(base, delta, 0, half);
		return {base, delta};
	}

	const value &val() const { return *this; }

	template<size_t Stop, size_t Start> part<N, Stop, Start> slice() { return {*this}; }
	template<size_t Bit> part<N, Bit, Bit> slice() { return {*this}; }
	template<size_t Bit> value<1> slice() const { return slice<Bit, Bit>(); }

	template<size_t Stop, size_t Start> STRETCH_CALLED value<Stop - Start + 1> slice() const {
		constexpr size_t M = Stop - Start + 1;
		value<M> result;
		for (size_t n = 0; n < result.words; n++)
			result.word[n] = get(Start + 64 * n) & ones(M - 64 * n);
		if (moves()) {
			if (delta == UNKNOWN || words > 1)
				result.delta = UNKNOWN;
			else if constexpr (words == 1) {
				// The bits from Start on change with the carry, and by whole units without one.
				wide_int unit = wide_int(1) << Start, base = word[0];
				if (delta % unit)
					keep(base, delta, base >> Start << Start, (base >> Start << Start) + unit);
				else
					result = value<M>::of(line{base >> Start, delta >> Start});
			}
		}
		return result;
	}

	template<size_t M> STRETCH_CALLED value<N + M> concat(const value<M> &low) const {
		value<N + M> result;
		for (size_t n = 0; n < low.words; n++)
			result.put(low.word[n], 64 * n, M - 64 * n);
		for (size_t n = 0; n < words; n++)
			result.put(word[n], M + 64 * n, N - 64 * n);
		if (moves() || low.moves()) {
			result.delta = UNKNOWN;
			if constexpr (N + M <= 62)
				if (delta != UNKNOWN && low.delta != UNKNOWN)
					result.delta = int64_t((uint64_t(delta) << M) + uint64_t(low.delta));
		}
		return result;
	}

	template<size_t K, size_t Stop, size_t Start> auto concat(const part<K, Stop, Start> &low) const {
		return concat(low.val());
	}

	template<size_t R> STRETCH_CALLED value<R * N> repeat() const {
		value<R * N> result;
		for (size_t n = 0; n < R; n++)
			for (size_t m = 0; m < words; m++)
				result.put(word[m], n * N + 64 * m, N - 64 * m);
		if (moves())
			result.delta = UNKNOWN;
		return result;
	}

	uint64_t get(size_t start) const {
		size_t n = start / 64, shift = start % 64;
		uint64_t found = n < words ? word[n] >> shift : 0;
		return shift && n + 1 < words ? found | word[n + 1] << (64 - shift) : found;
	}

	void put(uint64_t bits, size_t start, size_t count) {
		size_t n = start / 64, shift = start % 64;
		uint64_t mask = ones(count);
		if (n < words)
			word[n] = (word[n] & ~(mask << shift)) | (bits & mask) << shift;
		if (shift && n + 1 < words)
			word[n + 1] = (word[n + 1] & ~(mask >> (64 - shift))) | (bits & mask) >> (64 - shift);
	}
};

// Bits of a value, which can be assigned.
template<size_t N, size_t Stop, size_t Start> struct part {
	value<N> &whole;

	value<Stop - Start + 1> val() const {
		return static_cast<const value<N> &>(whole).template slice<Stop, Start>();
	}

	template<class Low> auto concat(const Low &low) const { return val().concat(low); }
	template<size_t R> auto repeat() const { return val().template repeat<R>(); }

	STRETCH_CALLED part &operator=(const value<Stop - Start + 1> &bits) {
		for (size_t n = 0; n < bits.words; n++)
			whole.put(bits.word[n], Start + 64 * n, Stop - Start + 1 - 64 * n);
		if (bits.moves() || whole.moves()) {
			bool fits = whole.words == 1 && !whole.moves() && bits.delta != UNKNOWN && Start < 62
				&& bits.delta >> (62 - Start) == bits.delta >> 63;
			whole.delta = fits ? int64_t(uint64_t(bits.delta) << Start) : UNKNOWN;
		}
		return *this;
	}
};

template<size_t N> struct wire {
	value<N> curr, next;
};

// A place in a memory; it is that of clock 0 alone if the address moves.
struct memory_index {
	struct place {
		size_t number;
		bool moves;
	};
	bool valid;
	place index;

	template<size_t N> memory_index(const value<N> &address, size_t offset, size_t depth) {
		index = {size_t(address.word[0]) - offset, address.moves()};
		valid = index.number < depth;
		if (index.moves && !valid)
			limit(1);
	}
};

// Reads the memory of the design. A write that changes it ends the stretch.
template<size_t N> struct memory {
	const cxxrtl_yosys::value<N> *rows = nullptr;

	value<N> operator[](memory_index::place place) const {
		value<N> result;
		std::memcpy(result.word, rows[place.number].data, sizeof(rows->data));
		if (place.moves)
			result.delta = UNKNOWN;
		return result;
	}

	void update(memory_index::place place, const value<N> &bits, const value<N> &mask, int) {
		value<N> row = (*this)[place];
		bool any = false, same = !place.moves && !bits.moves();
		for (size_t n = 0; n < row.words; n++) {
			any |= mask.word[n] != 0;
			same &= !((row.word[n] ^ bits.word[n]) & mask.word[n]);
		}
		if (mask.moves() || (any && !same))
			limit(1);
	}
};

template<size_t A, size_t B> constexpr bool fit = A <= 64 && B <= 64;
template<class A, class B> bool known(const A &a, const B &b) { return a.delta != UNKNOWN && b.delta != UNKNOWN; }

// An operation on what does not move, in 64 bits, and on lines.
#define STRETCH_BINARY(OP, KIND, BITS, ...) \
template<size_t Y, size_t A, size_t B> STRETCH_CALLED value<Y> OP(const value<A> &a, const value<B> &b) { \
	if constexpr (fit<A, B> && Y <= 64) { \
		if (!a.moves() && !b.moves()) { \
			auto p = a.KIND##_bits(); \
			auto q = b.KIND##_bits(); \
			return value<Y>::of(uint64_t(BITS)); \
		} \
		if (known(a, b)) { \
			auto p = a.KIND##_line(), q = b.KIND##_line(); \
			__VA_ARGS__ \
		} \
	} \
	return value<Y>::unknown(); \
}

// Sums, differences and products are lines again, if what they are made of is.
#define STRETCH_PRODUCT \
	if (A + B <= 62 && !b.moves()) \
		return value<Y>::of(line{p.base * q.base, p.delta * q.base}); \
	if (A + B <= 62 && !a.moves()) \
		return value<Y>::of(line{p.base * q.base, p.base * q.delta});
STRETCH_BINARY(add_uu, unsigned, p + q, return value<Y>::of(line{p.base + q.base, p.delta + q.delta});)
STRETCH_BINARY(add_ss, signed, uint64_t(p) + q, return value<Y>::of(line{p.base + q.base, p.delta + q.delta});)
STRETCH_BINARY(sub_uu, unsigned, p - q, return value<Y>::of(line{p.base - q.base, p.delta - q.delta});)
STRETCH_BINARY(sub_ss, signed, uint64_t(p) - q, return value<Y>::of(line{p.base - q.base, p.delta - q.delta});)
STRETCH_BINARY(mul_uu, unsigned, p * q, STRETCH_PRODUCT)
STRETCH_BINARY(mul_ss, signed, uint64_t(p) * q, STRETCH_PRODUCT)

// Bit by bit only what does not move.
STRETCH_BINARY(and_uu, unsigned, p & q, )
STRETCH_BINARY(and_ss, signed, p & q, )
STRETCH_BINARY(or_uu, unsigned, p | q, )
STRETCH_BINARY(or_ss, signed, p | q, )
STRETCH_BINARY(xor_uu, unsigned, p ^ q, )
STRETCH_BINARY(xor_ss, signed, p ^ q, )
STRETCH_BINARY(xnor_uu, unsigned, ~(p ^ q), )
STRETCH_BINARY(xnor_ss, signed, ~(p ^ q), )
STRETCH_BINARY(shl_uu, unsigned, q < 64 ? p << q : 0, )
STRETCH_BINARY(sshl_uu, unsigned, q < 64 ? p << q : 0, )
STRETCH_BINARY(shr_uu, unsigned, q < 64 ? p >> q : 0, )
STRETCH_BINARY(sshr_uu, unsigned, q < 64 ? p >> q : 0, )
STRETCH_BINARY(shift_uu, unsigned, q < 64 ? p >> q : 0, )
STRETCH_BINARY(shiftx_uu, unsigned, q < 64 ? p >> q : 0, )

// A comparison holds as long as its outcome does.
STRETCH_CALLED inline bool less(line p, line q) {
	wide_int base = p.base - q.base, delta = p.delta - q.delta, end = wide_int(1) << 66;
	base < 0 ? keep(base, delta, -end, 0) : keep(base, delta, 0, end);
	return base < 0;
}
STRETCH_CALLED inline bool equal(line p, line q) {
	keep_zeroness(p.base - q.base, p.delta - q.delta);
	return p.base == q.base;
}
STRETCH_BINARY(lt_uu, unsigned, p < q, return value<Y>::of(uint64_t(less(p, q)));)
STRETCH_BINARY(lt_ss, signed, p < q, return value<Y>::of(uint64_t(less(p, q)));)
STRETCH_BINARY(gt_uu, unsigned, p > q, return value<Y>::of(uint64_t(less(q, p)));)
STRETCH_BINARY(gt_ss, signed, p > q, return value<Y>::of(uint64_t(less(q, p)));)
STRETCH_BINARY(le_uu, unsigned, p <= q, return value<Y>::of(uint64_t(!less(q, p)));)
STRETCH_BINARY(le_ss, signed, p <= q, return value<Y>::of(uint64_t(!less(q, p)));)
STRETCH_BINARY(ge_uu, unsigned, p >= q, return value<Y>::of(uint64_t(!less(p, q)));)
STRETCH_BINARY(ge_ss, signed, p >= q, return value<Y>::of(uint64_t(!less(p, q)));)
STRETCH_BINARY(eq_uu, unsigned, p == q, return value<Y>::of(uint64_t(equal(p, q)));)
STRETCH_BINARY(eq_ss, signed, p == q, return value<Y>::of(uint64_t(equal(p, q)));)
STRETCH_BINARY(ne_uu, unsigned, p != q, return value<Y>::of(uint64_t(!equal(p, q)));)
STRETCH_BINARY(ne_ss, signed, p != q, return value<Y>::of(uint64_t(!equal(p, q)));)

#define STRETCH_UNARY(OP, KIND, BITS, ...) \
template<size_t Y, size_t A> STRETCH_CALLED value<Y> OP(const value<A> &a) { \
	if constexpr (A <= 64 && Y <= 64) { \
		if (!a.moves()) { \
			uint64_t p = uint64_t(a.KIND##_bits()); \
			return value<Y>::of(uint64_t(BITS)); \
		} \
		if (a.delta != UNKNOWN) { \
			auto p = a.KIND##_line(); \
			return value<Y>::of(line __VA_ARGS__); \
		} \
	} \
	return value<Y>::unknown(); \
}
STRETCH_UNARY(pos_u, unsigned, p, {p.base, p.delta})
STRETCH_UNARY(pos_s, signed, p, {p.base, p.delta})
STRETCH_UNARY(neg_u, unsigned, -p, {-p.base, -p.delta})
STRETCH_UNARY(neg_s, signed, -p, {-p.base, -p.delta})
STRETCH_UNARY(not_u, unsigned, ~p, {-1 - p.base, -p.delta})
STRETCH_UNARY(not_s, signed, ~p, {-1 - p.base, -p.delta})

// These hold as long as what they ask does, which is whether a value is 0.
template<size_t Y, size_t A> STRETCH_CALLED value<Y> reduce_or(const value<A> &a) {
	return a.delta == UNKNOWN ? value<Y>::unknown() : value<Y>::of(uint64_t(bool(a)));
}
template<size_t Y, size_t A> STRETCH_CALLED value<Y> reduce_bool(const value<A> &a) { return reduce_or<Y>(a); }
template<size_t Y, size_t A> STRETCH_CALLED value<Y> logic_not(const value<A> &a) {
	return a.delta == UNKNOWN ? value<Y>::unknown() : value<Y>::of(uint64_t(!bool(a)));
}
template<size_t Y, size_t A> STRETCH_CALLED value<Y> reduce_and(const value<A> &a) {
	if (a.delta == UNKNOWN)
		return value<Y>::unknown();
	return value<Y>::of(uint64_t(!bool(not_u<A>(a))));
}
template<size_t Y, size_t A> STRETCH_CALLED value<Y> reduce_xor(const value<A> &a) {
	uint64_t all = 0;
	for (auto each : a.word)
		all ^= each;
	return a.moves() ? value<Y>::unknown() : value<Y>::of(uint64_t(__builtin_parityll(all)));
}

}  // namespace stretch
