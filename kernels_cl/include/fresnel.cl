// Fresnel reflectance: the counterpart of jaxbrdf/core/fresnel.py for a cosine in (0, 1].
#ifndef JB_FRESNEL_CL
#define JB_FRESNEL_CL

#include "numerics.cl"

// (1 - cos)^5, the weight of Schlick's curve.
JB_INLINE jb_real jb_schlick_weight(const jb_real cos) {
    const jb_real grazing = 1.0f - cos;
    const jb_real square = grazing * grazing;
    return square * square * grazing;
}

// Exact reflectance of a dielectric of index eta >= 1, of `excess` = eta^2 - 1. With g^2 = excess + cos^2 the amplitudes
// (cos - g) / (cos + g) and (eta^2 cos - g) / (eta^2 cos + g) are taken times their denominators: as
// -excess / (cos + g)^2 and excess ((eta^2 + 1) cos^2 - 1) / (eta^2 cos + g)^2 they keep their digits at any index.
JB_INLINE jb_real jb_dielectric(const jb_real cos, const float excess) {
    const jb_real square = cos * cos;
    const jb_real g = jb_safe_sqrt(excess + square);
    const jb_real across = cos + g;
    const jb_real along = (excess + 1.0f) * cos + g;
    const jb_real r_across = excess / (across * across);
    const jb_real r_along = excess * ((excess + 2.0f) * square - 1.0f) / (along * along);
    return 0.5f * (r_across * r_across + r_along * r_along);
}

#endif
