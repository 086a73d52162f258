// A bare network over planar arrays: y of `count` inputs x.
#include "queries.cl"
#include "network.cl"

__kernel __attribute__((reqd_work_group_size(JB_GROUP, 1, 1))) void JB_NAME(network)(
    const ulong count, __global const float *inputs, __global float *outputs, __global const float *parameters) {
    const size_t item = get_global_id(0) * JB_WIDTH;
    if (item >= count) {
        return;
    }
    __global const float *weights = parameters;
    jb_real first[JB_MLP_WIDEST], second[JB_MLP_WIDEST];
    jb_real *x = first, *y = second;
    for (int i = 0; i < JB_MLP_INPUTS; ++i) {
        x[i] = jb_load(inputs + i * count, item, count);
    }
    JB_MLP_LAYERS(JB_LAYER)
    for (int o = 0; o < JB_MLP_OUTPUTS; ++o) {
        jb_store(outputs + o * count, item, count, x[o]);
    }
}
