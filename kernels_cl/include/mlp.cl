// A fully connected network of the sizes MLP_WIDTHS, SiLU after every layer but the last: the counterpart of
// jaxbrdf/models/mlp.py. Needs MLP_LAYERS, MLP_WIDTHS (MLP_LAYERS + 1 numbers) and MLP_WIDEST.
#ifndef JAXBRDF_MLP_CL
#define JAXBRDF_MLP_CL

#include "memory.cl"

__constant int mlp_widths[] = {MLP_WIDTHS};

// x / (1 + exp(-x)); where exp overflows it is -0, its limit.
float silu(const float x) { return x / (1.0f + exp(-x)); }

// The network in place: x holds the inputs, then the outputs. `parameters` holds the weights (n_in, n_out) and the
// biases of one layer after the other.
void mlp_apply(WEIGHTS float *parameters, float x[MLP_WIDEST]) {
    float y[MLP_WIDEST];
    for (int layer = 0; layer < MLP_LAYERS; ++layer) {
        const int n_in = mlp_widths[layer];
        const int n_out = mlp_widths[layer + 1];
        WEIGHTS float *biases = parameters + n_in * n_out;
        for (int o = 0; o < n_out; ++o) {
            y[o] = biases[o];
            for (int i = 0; i < n_in; ++i) {
                y[o] += x[i] * parameters[i * n_out + o];
            }
        }
        for (int o = 0; o < n_out; ++o) {
            x[o] = layer + 1 < MLP_LAYERS ? silu(y[o]) : y[o];
        }
        parameters = biases + n_out;
    }
}

#endif
