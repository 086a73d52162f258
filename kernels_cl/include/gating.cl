// Matrices in textures over the disk, times a latent: the counterpart of jaxbrdf/texture/gated.py (Timonen
// et al., Eq. 6).
//
// A texel is a matrix row by row, each row padded to whole blocks of eight. A latent comes as lookups leave it, one vector of
// each query for each block: so neither is transposed, only the sums are.
#ifndef JB_GATING_CL
#define JB_GATING_CL

#include "angular.cl"

#if JB_WIDTH == 1

// The sum over one query's channels.
JB_INLINE jb_real jb_sums(const float8 *rows) {
    const float4 fours = rows[0].lo + rows[0].hi;
    return (fours.x + fours.y) + (fours.z + fours.w);
}

#else

// The sums over four queries' channels.
JB_INLINE float4 jb_four_sums(const float8 *rows) {
    const float8 a = rows[0], b = rows[1], c = rows[2], d = rows[3];
    const float8 ab = (float8)(a.lo, b.lo) + (float8)(a.hi, b.hi);
    const float8 cd = (float8)(c.lo, d.lo) + (float8)(c.hi, d.hi);
    const float8 twos = (float8)(ab.s02, cd.s02, ab.s46, cd.s46) + (float8)(ab.s13, cd.s13, ab.s57, cd.s57);
    return twos.s0426 + twos.s1537;
}

// The sums over the channels of each query.
JB_INLINE jb_real jb_sums(const float8 *rows) {
#if JB_WIDTH == 4
    return jb_four_sums(rows);
#elif JB_WIDTH == 8
    return (float8)(jb_four_sums(rows), jb_four_sums(rows + 4));
#else
    return (float16)(jb_four_sums(rows), jb_four_sums(rows + 4), jb_four_sums(rows + 8), jb_four_sums(rows + 12));
#endif
}

#endif

// The product of the matrix at radius r and azimuth `turn`, of `count` rows of `blocks` blocks, with z: `count` numbers of
// each query. `products` has room for JB_WIDTH vectors of each row.
JB_INLINE void jb_gated_fetch(
    __global const jb_stored *texels, const int n_r, const int n_phi, const int count, const int blocks, const jb_real r,
    const jb_real turn, const float8 *z, float8 *products, jb_real *out) {
    const jb_Corners at = jb_corners(n_r, n_phi, count * blocks * JB_BLOCK, r, turn);
    for (int k = 0; k < JB_WIDTH; ++k) {
        _Pragma("unroll") for (int i = 0; i < count; ++i) {
            float8 product = jb_blend(texels + i * blocks * JB_BLOCK, &at, k) * z[k];
            for (int block = 1; block < blocks; ++block) {
                product += jb_blend(texels + (i * blocks + block) * JB_BLOCK, &at, k) * z[block * JB_WIDTH + k];
            }
            products[i * JB_WIDTH + k] = product;
        }
    }
    _Pragma("unroll") for (int i = 0; i < count; ++i) { out[i] = jb_sums(products + i * JB_WIDTH); }
}

#endif
