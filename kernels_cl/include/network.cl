// A fully connected network, layer by layer: the counterpart of jaxbrdf/models/mlp.py.
//
// A layer is computed in tiles of a few outputs, whose sums stay in registers while the inputs stream by: how many fit
// is the device's business, so the host cuts each layer into `tiles` of `rows` outputs and `more` of `rows - 1`, and
// lays out the parameters accordingly: a tile's biases, then its weights for the first input, for the second, and so on.
#ifndef JB_NETWORK_CL
#define JB_NETWORK_CL

#include "numerics.cl"

// A processor runs a tile's inputs four at a time: its two threads a core share the fetching of instructions, where a
// short loop's jumps take what the multiply-adds need. A GPU has all loops unrolled.
#ifdef JB_UNROLL
#define JB_UNROLLED _Pragma("unroll")
#define JB_PARTLY_UNROLLED _Pragma("unroll")
#else
#define JB_UNROLLED
#define JB_PARTLY_UNROLLED _Pragma("unroll 4")
#endif

JB_INLINE jb_real jb_linear(const jb_real x) { return x; }

JB_INLINE jb_real jb_relu(const jb_real x) { return x < 0.0f ? JB_REAL(0.0f) : x; }

// y[0..R) = activation(biases + weights x), R outputs of a layer of n_in inputs.
#define JB_TILE(R, activation)                                                                                        \
    JB_INLINE void jb_tile_##activation##_##R(                                                                        \
        const jb_real *x, const int n_in, JB_WEIGHTS const float *parameters, jb_real *y) {                           \
        jb_real sum[R];                                                                                               \
        _Pragma("unroll") for (int r = 0; r < R; ++r) { sum[r] = JB_REAL(parameters[r]); }                            \
        JB_PARTLY_UNROLLED for (int i = 0; i < n_in; ++i) {                                                           \
            JB_WEIGHTS const float *weights = parameters + (i + 1) * R;                                               \
            const jb_real input = x[i];                                                                               \
            _Pragma("unroll") for (int r = 0; r < R; ++r) { sum[r] += input * weights[r]; }                           \
        }                                                                                                             \
        _Pragma("unroll") for (int r = 0; r < R; ++r) { y[r] = jb_##activation(sum[r]); }                             \
    }

#define JB_TILES(activation)                                                                                          \
    JB_TILE(1, activation)                                                                                            \
    JB_TILE(2, activation)                                                                                            \
    JB_TILE(3, activation)                                                                                            \
    JB_TILE(4, activation)                                                                                            \
    JB_TILE(5, activation)                                                                                            \
    JB_TILE(6, activation)                                                                                            \
    JB_TILE(7, activation)                                                                                            \
    JB_TILE(8, activation)                                                                                            \
    JB_TILE(9, activation)                                                                                            \
    JB_TILE(10, activation)                                                                                           \
    JB_TILE(11, activation)                                                                                           \
    JB_TILE(12, activation)

JB_TILES(linear)
JB_TILES(relu)

// What is left to do with a whole layer: an activation too long for a tile's registers.
JB_INLINE void jb_nothing_after(jb_real *y, const int count) {}

// SiLU of x = -ln(2) t, over -ln(2): t / (1 + 2^t), to 4e-7 relative up to t = 127, beyond to 6e-39 |t|. A NaN stays. The
// host has scaled the weights on both sides accordingly. One output's division runs beside the next one's exponential.
#define JB_SILU_AFTER(name, exp2)                                                                                     \
    JB_INLINE void jb_##name##_after(jb_real *y, const int count) {                                                   \
        jb_real below = 1.0f + exp2(y[0]);                                                                            \
        JB_UNROLLED for (int o = 1; o < count; ++o) {                                                                 \
            y[o - 1] = y[o - 1] / below;                                                                              \
            below = 1.0f + exp2(y[o]);                                                                                \
        }                                                                                                             \
        y[count - 1] = y[count - 1] / below;                                                                          \
    }

JB_SILU_AFTER(silu, jb_exp2)
// For t from -126 to 127 alone: of a layer whose inputs and weights keep it there.
JB_SILU_AFTER(bounded_silu, jb_bounded_exp2)

// One layer from the array x to the array y, whose names then change places; `weights` moves on to the next layer.
#define JB_LAYER(n_in, tiles, rows, more, rows_of_more, activation, after)                                            \
    {                                                                                                                 \
        jb_real *out = y;                                                                                             \
        JB_UNROLLED for (int t = 0; t < tiles; ++t) {                                                                 \
            jb_tile_##activation##_##rows(x, n_in, weights, out);                                                     \
            weights += rows * (n_in + 1);                                                                             \
            out += rows;                                                                                              \
        }                                                                                                             \
        JB_UNROLLED for (int t = 0; t < more; ++t) {                                                                  \
            jb_tile_##activation##_##rows_of_more(x, n_in, weights, out);                                             \
            weights += rows_of_more * (n_in + 1);                                                                     \
            out += rows_of_more;                                                                                      \
        }                                                                                                             \
        jb_##after##_after(y, tiles * rows + more * rows_of_more);                                                    \
        jb_real *next = x;                                                                                            \
        x = y;                                                                                                        \
        y = next;                                                                                                     \
    }

#endif
