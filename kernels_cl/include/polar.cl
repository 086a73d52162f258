// Directions as places on the unit disk, and their learned radial warp: the counterparts of `polar` in
// jaxbrdf/texture/angular.py and of jaxbrdf/models/warp.py.
#ifndef JAXBRDF_POLAR_CL
#define JAXBRDF_POLAR_CL

#include "directions.cl"
#include "memory.cl"

// Length of w's projection on the surface, in [0, 1].
float disk_radius(const float3 w) { return fmin(sin_theta(w), 1.0f); }

// Azimuth of w over its period [radians], in [0, 1).
float disk_turn(const float3 w, const float period) {
    const float turn = safe_atan2(w.y, w.x) / period;
    const float wrapped = turn - floor(turn);
    return wrapped < 1.0f ? wrapped : 0.0f;
}

// sum_k w_k r^alpha_k (Timonen et al., Eq. 7); `terms` holds the w, then the alpha.
float radial_warp(WEIGHTS float *terms, const int count, const float r) {
    const float log_r = log(fmax(r, TINY));
    float warped = 0.0f;
    for (int k = 0; k < count; ++k) {
        warped += terms[k] * exp(terms[count + k] * log_r);
    }
    return warped;
}

#endif
