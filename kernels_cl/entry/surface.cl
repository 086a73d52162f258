// The kernel of one material that varies over a surface: f of `count` pairs of directions at places uv, under footprints where
// there is JB_PROBES, each four numbers row by row. Arrays are planar or interleaved (queries.cl); `parameters` holds the
// weights and, from JB_TEXELS on, the texels. Needs the material's JB_NAME(model).
#include "queries.cl"
#include "scale.cl"

__kernel __attribute__((reqd_work_group_size(JB_GROUP, 1, 1))) void JB_NAME(evaluate)(
    const ulong count, const uint is_interleaved, __global const float *wi, __global const float *wo,
    __global const float *uv,
#ifdef JB_PROBES
    __global const float *footprint,
#endif
    __global float *f, __global const float *parameters) {
#ifdef JB_LOCAL_WEIGHTS
    __local float weights[JB_WEIGHT_COUNT];
    for (int k = get_local_id(0); k < JB_WEIGHT_COUNT; k += JB_GROUP) {
        weights[k] = parameters[k];
    }
    barrier(CLK_LOCAL_MEM_FENCE);
#else
    __global const float *weights = parameters;
#endif
    const size_t first = get_global_id(0) * JB_WIDTH;
    if (first < count) {
        const jb_real3 light = jb_load_directions(wi, first, count, is_interleaved);
        const jb_real3 view = jb_load_directions(wo, first, count, is_interleaved);
        jb_real at[2];
        jb_load_columns(uv, 2, first, count, is_interleaved, at);
#ifdef JB_PROBES
        jb_real under[4];
        jb_load_columns(footprint, 4, first, count, is_interleaved, under);
        const jb_Footprint own = {under[0], under[1], under[2], under[3]};
#else
        const jb_Footprint own = {JB_REAL(0.0f), JB_REAL(0.0f), JB_REAL(0.0f), JB_REAL(0.0f)};
#endif
        __global const jb_stored *texels = (__global const jb_stored *)(parameters + JB_TEXELS);
        jb_real3 value = JB_NAME(model)(light, view, at[0], at[1], own, weights, texels);
#ifdef JB_SCALE
        value = jb_scaled(weights + JB_SCALE, light, view, value);
#endif
        jb_store_colours(f, first, count, is_interleaved, value);
    }
}
