// The kernel of one material: f of `count` pairs of directions, whose arrays are planar or interleaved (queries.cl).
// `parameters` holds the weights and, from JB_TEXELS on, the texels. Needs the material's JB_NAME(model).
#include "queries.cl"
#include "scale.cl"

#ifdef JB_TEXELS
#define JB_MODEL(wi, wo) JB_NAME(model)(wi, wo, weights, (__global const jb_stored *)(parameters + JB_TEXELS))
#else
#define JB_MODEL(wi, wo) JB_NAME(model)(wi, wo, weights)
#endif
#ifdef JB_SCALE
#define JB_REFLECTANCE(wi, wo) jb_scaled(weights + JB_SCALE, wi, wo, JB_MODEL(wi, wo))
#else
#define JB_REFLECTANCE(wi, wo) JB_MODEL(wi, wo)
#endif

__kernel __attribute__((reqd_work_group_size(JB_GROUP, 1, 1))) void JB_NAME(evaluate)(
    const ulong count, const uint is_interleaved, __global const float *wi, __global const float *wo,
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
        jb_store_colours(f, first, count, is_interleaved, JB_REFLECTANCE(light, view));
    }
}
#undef JB_MODEL
#undef JB_REFLECTANCE
