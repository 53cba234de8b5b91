// Values of any width, for what `write_cxxrtl` has written: the same names and the same results as those of
// CXXRTL's own header, for less work of the compiler, which has some thousand operations to expand. Values of
// up to 64 bits, almost all, are one number each while they are calculated with. Waveforms and names of
// registers take CXXRTL's own, and so does a design that uses what is not here. A value of no bits is 0.

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <vector>

#define VALUE_INLINE inline __attribute__((always_inline))
#define CXXRTL_ASSERT(condition)

namespace cxxrtl_yosys {

constexpr uint64_t ones(size_t bits) { return bits >= 64 ? ~uint64_t(0) : (uint64_t(1) << bits) - 1; }
constexpr uint32_t lowest(size_t bits) { return uint32_t(ones(bits < 32 ? bits : 32)); }
constexpr size_t most(size_t a, size_t b) { return a > b ? a : b; }

template<size_t N, size_t M> struct part;
template<class High, class Low> struct joint;

template<size_t N> struct value {
	static constexpr size_t bits = N, chunks = most((N + 31) / 32, 1);
	static constexpr bool narrow = N <= 64;
	uint32_t data[chunks] = {};

	value() = default;
	value(const value &) = default;
	value &operator=(const value &) & = default;

	template<class... Chunks> explicit constexpr value(uint32_t first, Chunks... rest) : data{first, rest...} {}

	// Makes the bits above the highest 0.
	VALUE_INLINE void trim() { data[chunks - 1] &= lowest(N - 32 * (chunks - 1)); }

	// Of a number, as many bits as it has.
	static VALUE_INLINE value of(uint64_t number) {
		value made;
		made.data[0] = uint32_t(number) & lowest(N);
		if constexpr (N > 32)
			made.data[1] = uint32_t(number >> 32) & lowest(N - 32);
		return made;
	}

	VALUE_INLINE uint64_t number() const {
		if constexpr (N > 32)
			return data[0] | uint64_t(data[1]) << 32;
		else
			return data[0];
	}

	VALUE_INLINE int64_t signed_number() const { return N ? int64_t(number() << (64 - N)) >> (64 - N) : 0; }

	VALUE_INLINE bool negative() const { return N && data[chunks - 1] >> (N - 1) % 32 & 1; }

	VALUE_INLINE explicit operator bool() const {
		if constexpr (narrow)
			return number();
		uint32_t any = 0;
		for (auto chunk : data)
			any |= chunk;
		return any;
	}

	VALUE_INLINE bool operator==(const value &other) const {
		if constexpr (narrow)
			return number() == other.number();
		return !std::memcmp(data, other.data, sizeof(data));
	}

	VALUE_INLINE bool operator!=(const value &other) const { return !(*this == other); }

	const value &val() const { return *this; }

	VALUE_INLINE value update(const value &other, const value &mask) const {
		value made;
		for (size_t n = 0; n < chunks; n++)
			made.data[n] = (data[n] & ~mask.data[n]) | (other.data[n] & mask.data[n]);
		return made;
	}

	// Another width: the lowest bits, or zeros above, or copies of the sign.
	template<size_t M> VALUE_INLINE value<M> zero_extended() const {
		if constexpr (M == N)
			return *this;
		else if constexpr (narrow && M <= 64)
			return value<M>::of(number());
		else {
			value<M> made;
			for (size_t n = 0; n < made.chunks && n < chunks; n++)
				made.data[n] = data[n];
			made.trim();
			return made;
		}
	}

	template<size_t M> VALUE_INLINE value<M> sign_extended() const {
		if constexpr (M <= N)
			return zero_extended<M>();
		else if constexpr (narrow && M <= 64)
			return value<M>::of(uint64_t(signed_number()));
		else {
			auto made = zero_extended<M>();
			if (negative()) {
				for (size_t n = chunks; n < made.chunks; n++)
					made.data[n] = ~uint32_t(0);
				if constexpr (N % 32)
					made.data[chunks - 1] |= ~lowest(N % 32);
				made.trim();
			}
			return made;
		}
	}

	// Bits from one on; those beyond the highest are 0.
	template<size_t M> VALUE_INLINE value<M> from(size_t start) const {
		if constexpr (narrow)
			return value<M>::of(start < 64 ? number() >> start : 0);
		else {
			value<M> made;
			size_t first = start / 32, shift = start % 32;
			for (size_t n = 0; n < made.chunks; n++) {
				uint64_t low = first + n < chunks ? data[first + n] : 0;
				uint64_t high = first + n + 1 < chunks ? data[first + n + 1] : 0;
				made.data[n] = uint32_t((low | high << 32) >> shift);
			}
			made.trim();
			return made;
		}
	}

	template<size_t M> VALUE_INLINE void put(const value<M> &other, size_t start) {
		if constexpr (narrow)
			*this = of((number() & ~(ones(M) << start)) | other.number() << start);
		else
			for (size_t n = 0; n < other.chunks; n++) {
				size_t first = start / 32 + n, shift = start % 32;
				uint32_t mask = lowest(M - 32 * n);
				data[first] = (data[first] & ~(mask << shift)) | other.data[n] << shift;
				if (shift && first + 1 < chunks && mask >> (32 - shift))
					data[first + 1] = (data[first + 1] & ~(mask >> (32 - shift)))
						| other.data[n] >> (32 - shift);
			}
	}

	template<size_t Stop, size_t Start> VALUE_INLINE value<Stop - Start + 1> slice() const {
		return from<Stop - Start + 1>(Start);
	}
	template<size_t Bit> VALUE_INLINE value<1> slice() const { return from<1>(Bit); }
	template<size_t Stop, size_t Start> VALUE_INLINE part<N, Stop - Start + 1> slice() { return {*this, Start}; }
	template<size_t Bit> VALUE_INLINE part<N, 1> slice() { return {*this, Bit}; }

	template<size_t M> VALUE_INLINE value<N + M> concat(const value<M> &low) const {
		if constexpr (N + M <= 64)
			return value<N + M>::of(number() << M | low.number());
		else {
			auto made = low.template zero_extended<N + M>();
			made.put(*this, M);
			return made;
		}
	}
	template<class Low> VALUE_INLINE auto concat(const Low &low) const { return concat(low.val()); }

	template<size_t Times> VALUE_INLINE value<Times> repeat() const {
		static_assert(N == 1);
		value<Times> made;
		for (size_t n = 0; n < made.chunks; n++)
			made.data[n] = -data[0] & lowest(Times - 32 * n);
		return made;
	}
};

// Some bits of a value, and parts that are side by side: they can be assigned.
template<size_t N, size_t M> struct part {
	static constexpr size_t bits = M;
	value<N> &whole;
	size_t start;

	VALUE_INLINE value<M> val() const { return whole.template from<M>(start); }
	VALUE_INLINE void operator=(const value<M> &given) const { whole.put(given, start); }
	template<size_t K> VALUE_INLINE auto concat(const value<K> &low) const { return val().concat(low); }
	template<class Low> VALUE_INLINE joint<part, Low> concat(const Low &low) const { return {*this, low}; }
	template<size_t Times> VALUE_INLINE auto repeat() const { return val().template repeat<Times>(); }
};

template<class High, class Low> struct joint {
	static constexpr size_t bits = High::bits + Low::bits;
	High high;
	Low low;

	VALUE_INLINE value<bits> val() const { return high.val().concat(low.val()); }
	VALUE_INLINE void operator=(const value<bits> &given) const {
		low = given.template from<Low::bits>(0);
		high = given.template from<High::bits>(Low::bits);
	}
	template<size_t K> VALUE_INLINE auto concat(const value<K> &more) const { return val().concat(more); }
	template<class More> VALUE_INLINE joint<joint, More> concat(const More &more) const { return {*this, more}; }
};

template<size_t N> struct wire {
	value<N> curr, next;

	wire() = default;
	template<class... Chunks> explicit constexpr wire(uint32_t first, Chunks... rest)
		: curr(first, rest...), next(first, rest...) {}
};

struct observer {};

template<size_t N> struct memory {
	struct write {
		size_t index;
		value<N> bits, mask;
		int priority;
	};
	const size_t depth;
	std::unique_ptr<value<N>[]> data;
	std::vector<write> writes;

	explicit memory(size_t depth) : depth(depth), data(new value<N>[depth]) {}

	VALUE_INLINE const value<N> &operator[](size_t index) const { return data[index]; }
	VALUE_INLINE value<N> &operator[](size_t index) { return data[index]; }

	// Writes at the end of the clock, the higher priority over the lower.
	void update(size_t index, const value<N> &bits, const value<N> &mask, int priority) {
		if (!mask)
			return;
		auto place = writes.end();
		while (place != writes.begin() && priority < place[-1].priority)
			place--;
		writes.insert(place, {index, bits, mask, priority});
	}

	bool commit(observer &) {
		bool changed = false;
		for (auto &each : writes) {
			auto row = data[each.index].update(each.bits, each.mask);
			changed |= row != data[each.index];
			data[each.index] = row;
		}
		writes.clear();
		return changed;
	}
};

struct memory_index {
	bool valid;
	size_t index;

	template<size_t N> VALUE_INLINE memory_index(const value<N> &address, size_t offset, size_t depth)
		: valid(address.data[0] >= offset && address.data[0] < offset + depth), index(address.data[0] - offset) {
		static_assert(N <= 32);
	}
};

struct performer;
struct interior {};
struct module {
	module() {}
	module(const module &) = delete;
	virtual ~module() {}
	virtual void reset() = 0;
	virtual bool eval(performer *) = 0;
};

// Operations: of A bits, or of A and B, they give Y bits. Each is named by what it does, and by whether its
// operands have signs.
template<size_t Y> VALUE_INLINE value<Y> truth(bool is) { return value<Y>(uint32_t(is)); }

template<size_t Y, size_t A> VALUE_INLINE value<Y> logic_not(const value<A> &a) { return truth<Y>(!a); }
template<size_t Y, size_t A> VALUE_INLINE value<Y> reduce_or(const value<A> &a) { return truth<Y>(bool(a)); }
template<size_t Y, size_t A> VALUE_INLINE value<Y> reduce_bool(const value<A> &a) { return truth<Y>(bool(a)); }
template<size_t Y, size_t A> VALUE_INLINE value<Y> reduce_and(const value<A> &a) {
	bool all = true;
	for (size_t n = 0; n < a.chunks; n++)
		all &= a.data[n] == lowest(A - 32 * n);
	return truth<Y>(all);
}
template<size_t Y, size_t A> VALUE_INLINE value<Y> reduce_xor(const value<A> &a) {
	uint32_t all = 0;
	for (auto chunk : a.data)
		all ^= chunk;
	return truth<Y>(__builtin_parity(all));
}
template<size_t Y, size_t A, size_t B> VALUE_INLINE value<Y> logic_and(const value<A> &a, const value<B> &b) {
	return truth<Y>(bool(a) && bool(b));
}
template<size_t Y, size_t A, size_t B> VALUE_INLINE value<Y> logic_or(const value<A> &a, const value<B> &b) {
	return truth<Y>(bool(a) || bool(b));
}

template<size_t Y, size_t A> VALUE_INLINE value<Y> pos_u(const value<A> &a) { return a.template zero_extended<Y>(); }
template<size_t Y, size_t A> VALUE_INLINE value<Y> pos_s(const value<A> &a) { return a.template sign_extended<Y>(); }

// Bit by bit.
template<size_t Y> VALUE_INLINE value<Y> inverted(value<Y> a) {
	for (size_t n = 0; n < a.chunks; n++)
		a.data[n] = ~a.data[n] & lowest(Y - 32 * n);
	return a;
}
template<size_t Y, size_t A> VALUE_INLINE value<Y> not_u(const value<A> &a) { return inverted<Y>(pos_u<Y>(a)); }
template<size_t Y, size_t A> VALUE_INLINE value<Y> not_s(const value<A> &a) { return inverted<Y>(pos_s<Y>(a)); }

#define VALUE_BITS(OP, SIGN, EXPRESSION) \
template<size_t Y, size_t A, size_t B> VALUE_INLINE value<Y> OP(const value<A> &a, const value<B> &b) { \
	auto p = pos_##SIGN<Y>(a), q = pos_##SIGN<Y>(b); \
	for (size_t n = 0; n < p.chunks; n++) \
		p.data[n] = EXPRESSION; \
	return p; \
}
VALUE_BITS(and_uu, u, p.data[n] & q.data[n])
VALUE_BITS(and_ss, s, p.data[n] & q.data[n])
VALUE_BITS(or_uu, u, p.data[n] | q.data[n])
VALUE_BITS(or_ss, s, p.data[n] | q.data[n])
VALUE_BITS(xor_uu, u, p.data[n] ^ q.data[n])
VALUE_BITS(xor_ss, s, p.data[n] ^ q.data[n])
VALUE_BITS(xnor_uu, u, ~(p.data[n] ^ q.data[n]) & lowest(Y - 32 * n))
VALUE_BITS(xnor_ss, s, ~(p.data[n] ^ q.data[n]) & lowest(Y - 32 * n))

// A sum, or a difference, modulo 2^Y.
template<bool Minus, size_t Y> VALUE_INLINE value<Y> plus(value<Y> a, const value<Y> &b) {
	if constexpr (Y <= 64)
		return value<Y>::of(Minus ? a.number() - b.number() : a.number() + b.number());
	else {
		uint64_t carry = Minus;
		for (size_t n = 0; n < a.chunks; n++) {
			carry += uint64_t(a.data[n]) + (Minus ? ~b.data[n] : b.data[n]);
			a.data[n] = uint32_t(carry);
			carry >>= 32;
		}
		a.trim();
		return a;
	}
}

// A product, modulo 2^Y.
template<size_t Y> VALUE_INLINE value<Y> times(const value<Y> &a, const value<Y> &b) {
	if constexpr (Y <= 64)
		return value<Y>::of(a.number() * b.number());
	else {
		value<Y> made;
		for (size_t n = 0; n < made.chunks; n++) {
			uint64_t carry = 0;
			for (size_t m = 0; n + m < made.chunks; m++) {
				carry += uint64_t(a.data[n]) * b.data[m] + made.data[n + m];
				made.data[n + m] = uint32_t(carry);
				carry >>= 32;
			}
		}
		made.trim();
		return made;
	}
}

#define VALUE_SUM(OP, SIGN, FUNCTION) \
template<size_t Y, size_t A, size_t B> VALUE_INLINE value<Y> OP(const value<A> &a, const value<B> &b) { \
	return FUNCTION(pos_##SIGN<Y>(a), pos_##SIGN<Y>(b)); \
}
VALUE_SUM(add_uu, u, plus<false>)
VALUE_SUM(add_ss, s, plus<false>)
VALUE_SUM(sub_uu, u, plus<true>)
VALUE_SUM(sub_ss, s, plus<true>)
VALUE_SUM(mul_uu, u, times)
VALUE_SUM(mul_ss, s, times)

template<size_t Y, size_t A> VALUE_INLINE value<Y> neg_u(const value<A> &a) { return plus<true>(value<Y>(), pos_u<Y>(a)); }
template<size_t Y, size_t A> VALUE_INLINE value<Y> neg_s(const value<A> &a) { return plus<true>(value<Y>(), pos_s<Y>(a)); }

// Comparisons, of operands as wide as the wider.
template<size_t N> VALUE_INLINE bool less(const value<N> &a, const value<N> &b) {
	if constexpr (N <= 64)
		return a.number() < b.number();
	for (size_t n = a.chunks; n-- > 0;)
		if (a.data[n] != b.data[n])
			return a.data[n] < b.data[n];
	return false;
}
template<size_t N> VALUE_INLINE bool signed_less(const value<N> &a, const value<N> &b) {
	if constexpr (N <= 64)
		return a.signed_number() < b.signed_number();
	return a.negative() != b.negative() ? a.negative() : less(a, b);
}

#define VALUE_COMPARED(OP, SIGN, EXPRESSION) \
template<size_t Y, size_t A, size_t B> VALUE_INLINE value<Y> OP(const value<A> &a, const value<B> &b) { \
	constexpr size_t N = most(A, B); \
	auto p = pos_##SIGN<N>(a), q = pos_##SIGN<N>(b); \
	return truth<Y>(EXPRESSION); \
}
VALUE_COMPARED(eq_uu, u, p == q)
VALUE_COMPARED(eq_ss, s, p == q)
VALUE_COMPARED(ne_uu, u, p != q)
VALUE_COMPARED(ne_ss, s, p != q)
VALUE_COMPARED(lt_uu, u, less(p, q))
VALUE_COMPARED(lt_ss, s, signed_less(p, q))
VALUE_COMPARED(gt_uu, u, less(q, p))
VALUE_COMPARED(gt_ss, s, signed_less(q, p))
VALUE_COMPARED(le_uu, u, !less(q, p))
VALUE_COMPARED(le_ss, s, !signed_less(q, p))
VALUE_COMPARED(ge_uu, u, !less(p, q))
VALUE_COMPARED(ge_ss, s, !signed_less(p, q))

// Shifts by an amount of bits without a sign.
template<size_t N, size_t B> VALUE_INLINE size_t amount(const value<B> &b) {
	for (size_t n = 1; n < b.chunks; n++)
		if (b.data[n])
			return N;
	return b.data[0] < N ? b.data[0] : N;
}

template<size_t Y, size_t A, size_t B> VALUE_INLINE value<Y> shr_uu(const value<A> &a, const value<B> &b) {
	constexpr size_t N = most(Y, A);
	return pos_u<N>(a).template from<N>(amount<N>(b)).template zero_extended<Y>();
}
template<size_t Y, size_t A, size_t B> VALUE_INLINE value<Y> shl_uu(const value<A> &a, const value<B> &b) {
	size_t start = amount<Y>(b);
	auto p = pos_u<Y>(a);
	if constexpr (Y <= 64)
		return value<Y>::of(start < 64 ? p.number() << start : 0);
	else {
		value<Y> made;
		for (size_t n = start / 32, shift = start % 32; n < made.chunks; n++) {
			uint64_t high = p.data[n - start / 32], low = n > start / 32 ? p.data[n - start / 32 - 1] : 0;
			made.data[n] = uint32_t((high << 32 | low) << shift >> 32);
		}
		made.trim();
		return made;
	}
}
// Copies of the sign come from above: inverted, they are zeros.
template<size_t Y, size_t A, size_t B> VALUE_INLINE value<Y> sshr_su(const value<A> &a, const value<B> &b) {
	constexpr size_t N = most(Y, A);
	auto p = pos_s<N>(a);
	return (p.negative() ? inverted(shr_uu<N>(inverted(p), b)) : shr_uu<N>(p, b)).template zero_extended<Y>();
}
template<size_t Y, size_t A, size_t B> VALUE_INLINE value<Y> shl_su(const value<A> &a, const value<B> &b) { return shl_uu<Y>(pos_s<Y>(a), b); }
template<size_t Y, size_t A, size_t B> VALUE_INLINE value<Y> sshl_uu(const value<A> &a, const value<B> &b) { return shl_uu<Y>(a, b); }
template<size_t Y, size_t A, size_t B> VALUE_INLINE value<Y> sshl_su(const value<A> &a, const value<B> &b) { return shl_su<Y>(a, b); }
template<size_t Y, size_t A, size_t B> VALUE_INLINE value<Y> sshr_uu(const value<A> &a, const value<B> &b) { return shr_uu<Y>(a, b); }
template<size_t Y, size_t A, size_t B> VALUE_INLINE value<Y> shift_uu(const value<A> &a, const value<B> &b) { return shr_uu<Y>(a, b); }
template<size_t Y, size_t A, size_t B> VALUE_INLINE value<Y> shiftx_uu(const value<A> &a, const value<B> &b) { return shr_uu<Y>(a, b); }

}  // namespace cxxrtl_yosys

using namespace cxxrtl_yosys;
