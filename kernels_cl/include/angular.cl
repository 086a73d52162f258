// Bilinear lookup in textures over the disk: the counterpart of `fetch` in jaxbrdf/texture/angular.py.
//
// Texels are stored (n_r, n_phi + 1, channels), the first row closed to one value, the first column standing again after
// the last, so that no lookup wraps, and the channels padded to whole blocks of eight: each query reads the corners of
// its cell as vectors over the channels, which are then transposed to vectors over the queries.
#ifndef JB_ANGULAR_CL
#define JB_ANGULAR_CL

#include "texels.cl"
#include "numerics.cl"

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

// The cells of all queries: where each one's first texel begins, what lies between texels along both axes, and the
// corners' weights.
typedef struct {
    jb_integer_lanes first;
    int stride;
    int row;
    jb_lanes near_left;
    jb_lanes near_right;
    jb_lanes far_left;
    jb_lanes far_right;
} jb_Corners;

// Of a texture whose texels are `stride` numbers, at radius r and azimuth `turn` in [0, 1].
JB_INLINE jb_Corners jb_corners(const int n_r, const int n_phi, const int stride, const jb_real r, const jb_real turn) {
    const jb_Cell radius = jb_radius_cell(r, n_r);
    const jb_Cell phi = jb_cell(jb_clamp_unit(turn) * (float)n_phi, n_phi - 1);
    const jb_real far = radius.along;
    const jb_real near = 1.0f - far;
    jb_Corners at;
    at.stride = stride;
    at.row = (n_phi + 1) * stride;
    at.first.all = radius.index * at.row + phi.index * stride;
    at.near_right.all = near * phi.along;
    at.far_right.all = far * phi.along;
    at.near_left.all = near - at.near_right.all;
    at.far_left.all = far - at.far_right.all;
    return at;
}

// A block of the k-th query's channels; `texels` begins with the block of the texture's first texel.
JB_INLINE float8 jb_blend(__global const jb_stored *texels, const jb_Corners *at, const int k) {
    __global const jb_stored *corner = texels + at->first.lane[k];
    float8 sum = jb_texel(corner) * at->near_left.lane[k];
    sum += jb_texel(corner + at->stride) * at->near_right.lane[k];
    sum += jb_texel(corner + at->row) * at->far_left.lane[k];
    sum += jb_texel(corner + at->row + at->stride) * at->far_right.lane[k];
    return sum;
}

// All channels at radius r and azimuth `turn`.
JB_INLINE void jb_angular_fetch(
    __global const jb_stored *texels, const int n_r, const int n_phi, const int channels, const jb_real r,
    const jb_real turn, jb_real *out) {
    const jb_Corners at = jb_corners(n_r, n_phi, (channels + JB_BLOCK - 1) / JB_BLOCK * JB_BLOCK, r, turn);
    for (int block = 0; block < channels; block += JB_BLOCK) {
        float8 rows[JB_WIDTH];
        _Pragma("unroll") for (int k = 0; k < JB_WIDTH; ++k) { rows[k] = jb_blend(texels + block, &at, k); }
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
