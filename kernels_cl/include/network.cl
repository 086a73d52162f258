// A fully connected network, layer by layer: the counterpart of jaxbrdf/models/mlp.py.
//
// A layer is computed in tiles of a few outputs, whose sums stay in registers while the inputs stream by: how many fit
// is the device's business, so the host cuts each layer into `tiles` of `rows` outputs and `more` of `rows - 1`, and
// lays out the parameters accordingly: a tile's biases, then its weights for the first input, for the second, and so on.
#ifndef JB_NETWORK_CL
#define JB_NETWORK_CL

#include "numerics.cl"

#ifdef JB_UNROLL
#define JB_UNROLLED _Pragma("unroll")
#else
#define JB_UNROLLED
#endif

// y[0..R) = biases + weights x, R outputs of a layer of n_in inputs.
#define JB_TILE(R)                                                                                                    \
    void jb_tile_##R(const jb_real *x, const int n_in, JB_WEIGHTS const float *parameters, jb_real *y) {              \
        jb_real sum[R];                                                                                               \
        _Pragma("unroll") for (int r = 0; r < R; ++r) { sum[r] = JB_REAL(parameters[r]); }                            \
        JB_UNROLLED for (int i = 0; i < n_in; ++i) {                                                                  \
            JB_WEIGHTS const float *weights = parameters + (i + 1) * R;                                               \
            const jb_real input = x[i];                                                                               \
            _Pragma("unroll") for (int r = 0; r < R; ++r) { sum[r] += input * weights[r]; }                           \
        }                                                                                                             \
        _Pragma("unroll") for (int r = 0; r < R; ++r) { y[r] = sum[r]; }                                              \
    }

JB_TILE(1)
JB_TILE(2)
JB_TILE(3)
JB_TILE(4)
JB_TILE(5)
JB_TILE(6)
JB_TILE(7)
JB_TILE(8)
JB_TILE(9)
JB_TILE(10)
JB_TILE(11)
JB_TILE(12)

// x / (1 + e^-x) to (4e-7 + 8e-8 |x|) relative above -80, where the product's rounding is the exponent's error; below, to
// 6e-39 |x|. A NaN stays.
jb_real jb_silu(const jb_real x) { return x / (1.0f + jb_exp2(-JB_LOG2_E * x)); }

// The activations of a whole layer, in place.
void jb_silu_layer(jb_real *y, const int count) {
    JB_UNROLLED for (int o = 0; o < count; ++o) { y[o] = jb_silu(y[o]); }
}

void jb_relu_layer(jb_real *y, const int count) {
    JB_UNROLLED for (int o = 0; o < count; ++o) { y[o] = y[o] < 0.0f ? JB_REAL(0.0f) : y[o]; }
}

void jb_linear_layer(jb_real *y, const int count) {}

// One layer from the array x to the array y, whose names then change places; `weights` moves on to the next layer.
#define JB_LAYER(n_in, tiles, rows, more, rows_of_more, activation)                                                   \
    {                                                                                                                 \
        jb_real *out = y;                                                                                             \
        JB_UNROLLED for (int t = 0; t < tiles; ++t) {                                                                 \
            jb_tile_##rows(x, n_in, weights, out);                                                                    \
            weights += rows * (n_in + 1);                                                                             \
            out += rows;                                                                                              \
        }                                                                                                             \
        JB_UNROLLED for (int t = 0; t < more; ++t) {                                                                  \
            jb_tile_##rows_of_more(x, n_in, weights, out);                                                            \
            weights += rows_of_more * (n_in + 1);                                                                     \
            out += rows_of_more;                                                                                      \
        }                                                                                                             \
        jb_##activation##_layer(y, tiles * rows + more * rows_of_more);                                               \
        jb_real *next = x;                                                                                            \
        x = y;                                                                                                        \
        y = next;                                                                                                     \
    }

#endif
