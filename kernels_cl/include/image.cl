// Spatial textures: the counterpart of jaxbrdf/texture/lookup.py, and of cell.py and footprint.py beneath it.
//
// Texels are a pyramid as jaxbrdf/texture/pyramid.py lays it out, its channels padded to whole blocks of eight. A level that
// a query takes no share of is not read.
#ifndef JB_IMAGE_CL
#define JB_IMAGE_CL

#include "texels.cl"
#include "numerics.cl"

#define JB_REPEAT 0
#define JB_CLAMP 1
#define JB_MIRROR 2

// A pyramid's size, JB_REPEAT, JB_CLAMP or JB_MIRROR, its last level and its channels: constants, once all is inlined.
typedef struct {
    int height;
    int width;
    int wrap;
    int top;
    int channels;
} jb_Layout;

// A level of each query: its size and its first texel.
typedef struct {
    jb_integer rows;
    jb_integer columns;
    jb_integer start;
} jb_Level;

// The level below a fractional one, and the share of the next.
typedef struct {
    jb_integer below;
    jb_real share;
} jb_Lod;

// Numbers of two texels of an axis, and the fraction beyond the first.
typedef struct {
    jb_integer low;
    jb_integer high;
    jb_real along;
} jb_Edge;

// A footprint's rows, of u and of v.
typedef struct {
    jb_real u_x;
    jb_real u_y;
    jb_real v_x;
    jb_real v_y;
} jb_Footprint;

// Equal lookups at even steps along a line through the centre.
typedef struct {
    jb_real count;
    jb_real u;
    jb_real v;
    jb_Lod lod;
} jb_Probes;

// Entries of a footprint in texels are clamped to 2^30 (LARGEST in footprint.py).
#define JB_LARGEST_FOOTPRINT 1073741824.0f

// A whole number from 0 to 2^22 as a float, by its bits, and back; -1 comes back too.
JB_INLINE jb_real jb_real_of(const jb_integer n) { return JB_AS_REAL(n + 0x4b400000) - JB_ROUNDER; }

JB_INLINE jb_integer jb_integer_of(const jb_real x) { return JB_AS_INTEGER(x + JB_ROUNDER) - 0x4b400000; }

// x - floor(x), rounded to at most 1; NaN for what is not finite. From 2^23 on all numbers are whole.
JB_INLINE jb_real jb_fraction(const jb_real x) {
    const jb_real size = jb_abs(x);
    const jb_real rounded = (size + 8388608.0f) - 8388608.0f;
    const jb_real whole = rounded > size ? rounded - 1.0f : rounded;
    const jb_real beyond = size - whole;
    const jb_real fraction = (x < 0.0f) & (beyond > 0.0f) ? 1.0f - beyond : beyond;
    return size < 8388608.0f ? fraction : 0.0f * x;
}

// x less whole periods: in [0, 1], mirrored in [0, 2]; clamped textures have none. A NaN stays.
JB_INLINE jb_real jb_in_period(const int wrap, const jb_real x) {
    if (wrap == JB_REPEAT) return jb_fraction(x);
    return wrap == JB_MIRROR ? 2.0f * jb_fraction(0.5f * x) : x;
}

// The same folded or clamped into [0, 1].
JB_INLINE jb_real jb_folded(const int wrap, const jb_real x) {
    const jb_real inside = jb_in_period(wrap, x);
    if (wrap == JB_MIRROR) return inside > 1.0f ? 2.0f - inside : inside;
    return jb_at_most(jb_at_least(inside, 0.0f), 1.0f);
}

// Between which of `count` texels x stands, their centres at (j + 1/2) / count; the texels are there whatever x is.
JB_INLINE jb_Edge jb_edge(const int wrap, const jb_real x, const jb_integer count) {
    const jb_real inside = jb_folded(wrap, x);
    const jb_real at = jb_max(inside, JB_REAL(0.0f)) * jb_real_of(count) - 0.5f;
    // at - 1/2 rounded to the nearest is rounded down, or at a whole number perhaps the one before: the same value
    const jb_real lower = ((at - 0.5f) + JB_ROUNDER) - JB_ROUNDER;
    const jb_integer index = jb_integer_of(lower);
    const jb_integer last = count - 1;
    jb_Edge edge;
    edge.low = index < 0 ? (wrap == JB_REPEAT ? last : (jb_integer)(0)) : index;
    edge.high = index < last ? index + 1 : (wrap == JB_REPEAT ? (jb_integer)(0) : last);
    edge.along = (at - lower) + 0.0f * inside;
    return edge;
}

JB_INLINE jb_integer jb_side(const int side, const jb_integer level) {
    const jb_integer halved = (jb_integer)(side) >> level;
    return halved > 1 ? halved : (jb_integer)(1);
}

// A level; past the last it is the last.
JB_INLINE jb_Level jb_level(const jb_Layout layout, const jb_integer any) {
    const jb_integer number = any < layout.top ? any : (jb_integer)(layout.top);
    jb_Level level = {jb_side(layout.height, number), jb_side(layout.width, number), (jb_integer)(0)};
    int height = layout.height, width = layout.width;
    for (int n = 0; n < layout.top; ++n) {
        level.start += number > n ? (jb_integer)(height * width) : (jb_integer)(0);
        height = height > 1 ? height >> 1 : 1;
        width = width > 1 ? width >> 1 : 1;
    }
    return level;
}

JB_INLINE void jb_clear(float8 *rows) {
    _Pragma("unroll") for (int k = 0; k < JB_WIDTH; ++k) { rows[k] = (float8)(0.0f); }
}

// Adds the bilinear values at (u, v), a block of the channels of each query, times its share.
JB_INLINE void jb_add_texels(
    __global const jb_stored *texels, const jb_Layout layout, const jb_Level level, const jb_real u, const jb_real v,
    const jb_real share, float8 *rows) {
    const int stride = (layout.channels + JB_BLOCK - 1) / JB_BLOCK * JB_BLOCK;
    const jb_Edge x = jb_edge(layout.wrap, u, level.columns), y = jb_edge(layout.wrap, v, level.rows);
    const jb_integer upper = level.start + y.low * level.columns, lower = level.start + y.high * level.columns;
    const jb_integer_lanes a = {upper + x.low}, b = {upper + x.high}, c = {lower + x.low}, d = {lower + x.high};
    const jb_real below = share * y.along, above = share - below;
    const jb_lanes of = {share}, of_b = {above * x.along}, of_d = {below * x.along};
    const jb_lanes of_a = {above - of_b.all}, of_c = {below - of_d.all};
    _Pragma("unroll") for (int k = 0; k < JB_WIDTH; ++k) {
        if (of.lane[k] == 0.0f) continue;
        float8 sum = jb_texel(texels + (size_t)a.lane[k] * stride) * of_a.lane[k];
        sum += jb_texel(texels + (size_t)b.lane[k] * stride) * of_b.lane[k];
        sum += jb_texel(texels + (size_t)c.lane[k] * stride) * of_c.lane[k];
        sum += jb_texel(texels + (size_t)d.lane[k] * stride) * of_d.lane[k];
        rows[k] += sum;
    }
}

// The levels around `lod`; outside the pyramid its first or last. A NaN's share is NaN.
JB_INLINE jb_Lod jb_between_levels(const jb_Layout layout, const jb_real lod) {
    const jb_real bounded = jb_at_most(jb_at_least(lod, 0.0f), (float)layout.top);
    const jb_real safe = jb_max(bounded, JB_REAL(0.0f));
    // at a whole number perhaps the level before, with a share of 1
    const jb_real below = ((safe - 0.5f) + JB_ROUNDER) - JB_ROUNDER;
    const jb_Lod out = {jb_integer_of(below), bounded - below};
    return out;
}

// Where a round footprint of `scale` texels is covered: level l and a share of (scale^2 / 4^l - 1) / 3 of the next, 2^l
// the power of two in `scale`. A NaN's share is NaN.
JB_INLINE jb_Lod jb_lod_of(const jb_Layout layout, const jb_real scale) {
    const jb_real bounded = jb_at_most(jb_at_least(scale, 1.0f), (float)(1 << layout.top));
    const jb_integer bits = JB_AS_INTEGER(jb_max(bounded, JB_REAL(1.0f)));
    const jb_real ratio = JB_AS_REAL((bits & 0x7fffff) | 0x3f800000);
    const jb_Lod out = {(bits >> 23) - 127, (ratio * ratio - 1.0f) * 0.333333333f + 0.0f * bounded};
    return out;
}

// At most `most` lookups that together have the footprint's covariance: `probes` of footprint.py.
JB_INLINE jb_Probes jb_probes(const jb_Layout layout, const jb_Footprint footprint, const int most) {
    const float largest = JB_LARGEST_FOOTPRINT;
    const jb_real a = jb_at_most(jb_at_least((float)layout.width * footprint.u_x, -largest), largest);
    const jb_real b = jb_at_most(jb_at_least((float)layout.width * footprint.u_y, -largest), largest);
    const jb_real c = jb_at_most(jb_at_least((float)layout.height * footprint.v_x, -largest), largest);
    const jb_real d = jb_at_most(jb_at_least((float)layout.height * footprint.v_y, -largest), largest);
    const jb_real p_x = 0.5f * (a + d), p_y = 0.5f * (c - b), q_x = 0.5f * (a - d), q_y = 0.5f * (c + b);
    const jb_real p = jb_safe_sqrt(p_x * p_x + p_y * p_y), q = jb_safe_sqrt(q_x * q_x + q_y * q_y);
    const jb_real major = p + q, own = jb_abs(p - q);
    const jb_real least = jb_max((1.0f / most) * major, JB_REAL(1.0f));
    const jb_real minor = jb_max(own, least);
    const jb_real beyond = jb_max(0.25f * (major - minor) * (major + minor), JB_REAL(0.0f));
    const jb_real excess = 12.0f * (own < least ? beyond : p * q);
    // the least whole number whose square is at least 1 + excess / minor^2
    const jb_real square = 1.0f + excess / (minor * minor);
    const jb_real nearest = (jb_safe_sqrt(square) + JB_ROUNDER) - JB_ROUNDER;
    const jb_real count = jb_at_most(nearest * nearest < square ? nearest + 1.0f : nearest, (float)most);
    const jb_real step = count > 1.0f ? jb_safe_sqrt(excess / jb_max(count * count - 1.0f, JB_REAL(1.0f))) : JB_REAL(0.0f);
    // the direction of sqrt(p q) as complex numbers, by the sum that does not cancel
    const jb_real x = p_x * q_x - p_y * q_y, y = p_x * q_y + p_y * q_x;
    const jb_real far = jb_safe_sqrt(x * x + y * y) + jb_abs(x);
    const jb_real scale = step * jb_safe_rsqrt(far * far + y * y);
    // zero, or NaN, which a root hides
    const jb_real fault = 0.0f * (a + b + c + d);
    jb_Probes out;
    out.count = jb_max(count, JB_REAL(1.0f));
    out.u = (x < 0.0f ? y : far) * scale * (1.0f / layout.width);
    out.v = (x < 0.0f ? far : y) * scale * (1.0f / layout.height);
    out.lod = jb_lod_of(layout, minor + fault);
    return out;
}

// Adds the values between the two levels of a jb_Lod.
JB_INLINE void jb_add_between(
    __global const jb_stored *texels, const jb_Layout layout, const jb_real u, const jb_real v, const jb_Lod lod,
    float8 *rows) {
    const jb_Level below = jb_level(layout, lod.below), above = jb_level(layout, lod.below + 1);
    jb_add_texels(texels, layout, below, u, v, 1.0f - lod.share, rows);
    jb_add_texels(texels, layout, above, u, v, lod.share, rows);
}

// A block of the channels of each query, from its probes, as many rounds as the query with the most of them takes.
JB_INLINE void jb_add_probes(
    __global const jb_stored *texels, const jb_Layout layout, const jb_real u, const jb_real v, const jb_Probes probes,
    float8 *rows) {
    const jb_Level below = jb_level(layout, probes.lod.below);
    const jb_Level above = jb_level(layout, probes.lod.below + 1);
    const jb_real whole = 1.0f / probes.count, of_above = whole * probes.lod.share;
    const jb_lanes count = {probes.count};
    float rounds = 1.0f;
    for (int k = 0; k < JB_WIDTH; ++k) {
        rounds = count.lane[k] > rounds ? count.lane[k] : rounds;
    }
    for (float n = 0.0f; n < rounds; n += 1.0f) {
        const jb_real steps = n - 0.5f * (probes.count - 1.0f);
        const jb_real at_u = u + steps * probes.u, at_v = v + steps * probes.v;
        const jb_integer is_there = n < probes.count;
        const jb_real none = JB_REAL(0.0f);
        jb_add_texels(texels, layout, below, at_u, at_v, is_there ? whole - of_above : none, rows);
        jb_add_texels(texels, layout, above, at_u, at_v, is_there ? of_above : none, rows);
    }
}

// A block of the channels of each query under its footprint: with one probe at most, no loop is compiled.
JB_INLINE void jb_add_under(
    __global const jb_stored *texels, const jb_Layout layout, const jb_real u, const jb_real v, const jb_Probes probes,
    const int most, float8 *rows) {
    if (most == 1) {
        jb_add_between(texels, layout, u, v, probes.lod, rows);
        return;
    }
    // in one period before the steps are added, which would lose their digits far outside
    jb_add_probes(texels, layout, jb_in_period(layout.wrap, u), jb_in_period(layout.wrap, v), probes, rows);
}

// All channels on one level, the same for all queries.
JB_INLINE void jb_bilinear(
    __global const jb_stored *texels, const jb_Layout layout, const jb_real u, const jb_real v, const int number,
    jb_real *out) {
    const jb_Level level = jb_level(layout, (jb_integer)(number));
    for (int block = 0; block < layout.channels; block += JB_BLOCK) {
        float8 rows[JB_WIDTH];
        jb_clear(rows);
        jb_add_texels(texels + block, layout, level, u, v, JB_REAL(1.0f), rows);
        JB_SPREAD(rows, (out + block), layout.channels - block)
    }
}

// All channels between the two levels of a jb_Lod.
JB_INLINE void jb_trilinear(
    __global const jb_stored *texels, const jb_Layout layout, const jb_real u, const jb_real v, const jb_Lod lod,
    jb_real *out) {
    for (int block = 0; block < layout.channels; block += JB_BLOCK) {
        float8 rows[JB_WIDTH];
        jb_clear(rows);
        jb_add_between(texels + block, layout, u, v, lod, rows);
        JB_SPREAD(rows, (out + block), layout.channels - block)
    }
}

// All channels under a footprint, with at most `most` probes along its major axis.
JB_INLINE void jb_anisotropic(
    __global const jb_stored *texels, const jb_Layout layout, const jb_real u, const jb_real v,
    const jb_Footprint footprint, const int most, jb_real *out) {
    const jb_Probes probes = jb_probes(layout, footprint, most);
    for (int block = 0; block < layout.channels; block += JB_BLOCK) {
        float8 rows[JB_WIDTH];
        jb_clear(rows);
        jb_add_under(texels + block, layout, u, v, probes, most, rows);
        JB_SPREAD(rows, (out + block), layout.channels - block)
    }
}

#endif
