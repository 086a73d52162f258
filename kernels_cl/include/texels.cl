// Texels of float or half, JB_STORED_BITS, whose channels are padded to whole blocks of eight: a query reads a block of a
// texel as one vector, and the vectors of all queries are transposed to vectors over the queries.
#ifndef JB_TEXELS_CL
#define JB_TEXELS_CL

#include "vector.cl"

#define JB_BLOCK 8

#if JB_STORED_BITS == 16

typedef half jb_stored;

JB_INLINE float8 jb_texel(__global const jb_stored *texels) { return vload_half8(0, texels); }

#else

typedef float jb_stored;
typedef float8 jb_float8_anywhere __attribute__((aligned(4)));

JB_INLINE float8 jb_texel(__global const jb_stored *texels) { return *(__global const jb_float8_anywhere *)texels; }

#endif

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

#endif
