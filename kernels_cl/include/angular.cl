// Bilinear lookup in textures over the disk: the counterpart of `fetch` in jaxbrdf/texture/angular.py.
//
// Texels are stored (n_r, n_phi + 1, channels), the first row closed to one value, the first column standing again after
// the last, so that no lookup wraps, and the channels padded to whole blocks of eight: each query reads the corners of
// its cell as vectors over the channels, which are then transposed to vectors over the queries.
#ifndef JB_ANGULAR_CL
#define JB_ANGULAR_CL

#include "vector.cl"
#include "numerics.cl"

#define JB_BLOCK 8

#if JB_STORED_BITS == 16

typedef half jb_stored;

JB_INLINE float8 jb_texel(__global const jb_stored *texels) { return vload_half8(0, texels); }

#else

typedef float jb_stored;
typedef float8 jb_float8_anywhere __attribute__((aligned(4)));

JB_INLINE float8 jb_texel(__global const jb_stored *texels) { return *(__global const jb_float8_anywhere *)texels; }

#endif

// A place between two texels of an axis: the lower one and the fraction beyond it, which may be 1.
typedef struct {
    jb_integer index;
    jb_real along;
} jb_Cell;

// A number clamped to [0, 1]; a NaN is 0, so that no lookup leaves its texture.
JB_INLINE jb_real jb_clamp_unit(const jb_real x) { return jb_min(x > 0.0f ? x : JB_REAL(0.0f), JB_REAL(1.0f)); }

// The cell at x >= 0 whose lower texel is at most `last`: x - 1/2 rounded to the nearest is x rounded down, or at a whole
// x perhaps the texel before, which gives the same value.
JB_INLINE jb_Cell jb_cell(const jb_real x, const int last) {
    const jb_real lower = jb_min(((x - 0.5f) + JB_ROUNDER) - JB_ROUNDER, JB_REAL((float)last));
    const jb_Cell cell = {JB_AS_INTEGER(lower + JB_ROUNDER) - 0x4b400000, x - lower};
    return cell;
}

// Radius r over rows that include both ends.
JB_INLINE jb_Cell jb_radius_cell(const jb_real r, const int n_r) { return jb_cell(jb_clamp_unit(r) * (float)(n_r - 1), n_r - 2); }

JB_INLINE float8 jb_mix(const float8 a, const float8 b, const float along) { return a + (b - a) * along; }

#if JB_WIDTH == 1

// One query's channels of a block to their places.
#define JB_SPREAD(rows, out, count)                                                                                   \
    {                                                                                                                 \
        const float lanes[JB_BLOCK] = {                                                                               \
            rows[0].s0, rows[0].s1, rows[0].s2, rows[0].s3, rows[0].s4, rows[0].s5, rows[0].s6, rows[0].s7};          \
        _Pragma("unroll") for (int c = 0; c < JB_BLOCK; ++c) { if (c < count) out[c] = lanes[c]; }                    \
    }

#else

// Four queries' channels 0 to 7 as vectors over the queries: channel c in the lower half of column c, channel c + 4 in its
// upper half.
JB_INLINE void jb_transpose(const float8 *rows, float8 *columns) {
    const float8 a = rows[0], b = rows[1], c = rows[2], d = rows[3];
    const float8 ab_low = (float8)(a.s0, b.s0, a.s1, b.s1, a.s4, b.s4, a.s5, b.s5);
    const float8 ab_high = (float8)(a.s2, b.s2, a.s3, b.s3, a.s6, b.s6, a.s7, b.s7);
    const float8 cd_low = (float8)(c.s0, d.s0, c.s1, d.s1, c.s4, d.s4, c.s5, d.s5);
    const float8 cd_high = (float8)(c.s2, d.s2, c.s3, d.s3, c.s6, d.s6, c.s7, d.s7);
    columns[0] = (float8)(ab_low.s01, cd_low.s01, ab_low.s45, cd_low.s45);
    columns[1] = (float8)(ab_low.s23, cd_low.s23, ab_low.s67, cd_low.s67);
    columns[2] = (float8)(ab_high.s01, cd_high.s01, ab_high.s45, cd_high.s45);
    columns[3] = (float8)(ab_high.s23, cd_high.s23, ab_high.s67, cd_high.s67);
}

// Half a column of every four queries, joined.
#if JB_WIDTH == 4
#define JB_JOINED(columns, c, half) columns[c].half
#elif JB_WIDTH == 8
#define JB_JOINED(columns, c, half) (float8)(columns[c].half, columns[4 + c].half)
#else
#define JB_JOINED(columns, c, half)                                                                                   \
    (float16)(columns[c].half, columns[4 + c].half, columns[8 + c].half, columns[12 + c].half)
#endif

#define JB_SPREAD(rows, out, count)                                                                                   \
    {                                                                                                                 \
        float8 columns[JB_WIDTH];                                                                                     \
        _Pragma("unroll") for (int q = 0; q < JB_WIDTH; q += 4) { jb_transpose(rows + q, columns + q); }              \
        _Pragma("unroll") for (int c = 0; c < 4; ++c) {                                                               \
            if (c < count) out[c] = JB_JOINED(columns, c, lo);                                                        \
            if (c + 4 < count) out[c + 4] = JB_JOINED(columns, c, hi);                                                \
        }                                                                                                             \
    }

#endif

// All channels at radius r and azimuth `turn` in [0, 1].
JB_INLINE void jb_angular_fetch(
    __global const jb_stored *texels, const int n_r, const int n_phi, const int channels, const jb_real r,
    const jb_real turn, jb_real *out) {
    const int stride = (channels + JB_BLOCK - 1) / JB_BLOCK * JB_BLOCK;
    const int row = (n_phi + 1) * stride;
    const jb_Cell radius = jb_radius_cell(r, n_r);
    const jb_Cell phi = jb_cell(jb_clamp_unit(turn) * (float)n_phi, n_phi - 1);
    const jb_integer_lanes at = {radius.index * row + phi.index * stride};
    const jb_real far = radius.along;
    const jb_real near = 1.0f - far;
    const jb_lanes near_right = {near * phi.along}, far_right = {far * phi.along};
    const jb_lanes near_left = {near - near_right.all}, far_left = {far - far_right.all};
    for (int block = 0; block < channels; block += JB_BLOCK) {
        float8 rows[JB_WIDTH];
        _Pragma("unroll") for (int k = 0; k < JB_WIDTH; ++k) {
            __global const jb_stored *corner = texels + at.lane[k] + block;
            float8 sum = jb_texel(corner) * near_left.lane[k];
            sum += jb_texel(corner + stride) * near_right.lane[k];
            sum += jb_texel(corner + row) * far_left.lane[k];
            sum += jb_texel(corner + row + stride) * far_right.lane[k];
            rows[k] = sum;
        }
        JB_SPREAD(rows, (out + block), channels - block)
    }
}

// The same of a texture without azimuth, stored (n_r, channels).
JB_INLINE void jb_radial_fetch(
    __global const jb_stored *texels, const int n_r, const int channels, const jb_real r, jb_real *out) {
    const int stride = (channels + JB_BLOCK - 1) / JB_BLOCK * JB_BLOCK;
    const jb_Cell radius = jb_radius_cell(r, n_r);
    const jb_integer_lanes at = {radius.index * stride};
    const jb_lanes along_r = {radius.along};
    for (int block = 0; block < channels; block += JB_BLOCK) {
        float8 rows[JB_WIDTH];
        _Pragma("unroll") for (int k = 0; k < JB_WIDTH; ++k) {
            __global const jb_stored *corner = texels + at.lane[k] + block;
            rows[k] = jb_mix(jb_texel(corner), jb_texel(corner + stride), along_r.lane[k]);
        }
        JB_SPREAD(rows, (out + block), channels - block)
    }
}

#endif
