// Unit vectors in the local frame, z = normal, x = tangent: the counterpart of jaxbrdf/core/directions.py.
#ifndef JAXBRDF_DIRECTIONS_CL
#define JAXBRDF_DIRECTIONS_CL

#include "numerics.cl"

typedef struct {
    float3 wh;
    float3 wd;
} HalfDifference;

// Cosine and sine of an azimuth.
typedef struct {
    float cos;
    float sin;
} Azimuth;

// Sine between w and the normal, from the components that keep their precision near the pole.
float sin_theta(const float3 w) { return safe_sqrt(w.x * w.x + w.y * w.y); }

// Whether both directions leave the front of the surface. A subnormal cosine counts as zero: JAX flushes it, and so do
// many devices.
bool above_horizon(const float3 wi, const float3 wo) { return wi.z >= FLT_MIN && wo.z >= FLT_MIN; }

// Azimuth of w about the normal, zero at the pole.
Azimuth azimuth_of(const float3 w) {
    const float sine = sin_theta(w);
    const Azimuth phi = {sine > 0.0f ? safe_divide(w.x, sine) : 1.0f, safe_divide(w.y, sine)};
    return phi;
}

// w turned about the normal by -phi.
float3 turn_back(const Azimuth phi, const float3 w) {
    return (float3)(phi.cos * w.x + phi.sin * w.y, phi.cos * w.y - phi.sin * w.x, w.z);
}

// wh = (wi + wo) / |wi + wo|, wd = Ry(-theta_h) Rz(-phi_h) wi (Rusinkiewicz 1998); x and y of wd from (wi - wo) / 2, which
// is exact where the directions almost meet.
HalfDifference half_difference(const float3 wi, const float3 wo) {
    HalfDifference out;
    out.wh = safe_normalize(wi + wo);
    const float3 across = turn_back(azimuth_of(out.wh), 0.5f * (wi - wo));
    out.wd.x = out.wh.z * across.x - sin_theta(out.wh) * across.z;
    out.wd.y = across.y;
    out.wd.z = 0.5f * dot(out.wh, wi + wo);
    return out;
}

#endif
