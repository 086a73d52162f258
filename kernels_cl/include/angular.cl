// Bilinear lookup in textures over the disk: the counterpart of `fetch` in jaxbrdf/texture/angular.py.
// Texels are stored (n_r, n_phi, channels), the first row closed to one value.
#ifndef JAXBRDF_ANGULAR_CL
#define JAXBRDF_ANGULAR_CL

// A place between two texels of an axis: the lower one and the fraction beyond it.
typedef struct {
    int index;
    float along;
} Cell;

Cell cell(const float x, const int last) {
    const int index = min((int)x, last);
    const Cell out = {index, x - index};
    return out;
}

// Radius r, clamped to [0, 1], over rows that include both ends.
Cell radius_cell(const float r, const int n_r) { return cell(clamp(r, 0.0f, 1.0f) * (n_r - 1), n_r - 2); }

// All channels at radius r and azimuth `turn` in [0, 1) of a texture whose columns wrap.
void angular_fetch(
    __global const float *texture, const int n_r, const int n_phi, const int channels, const float r, const float turn,
    float *out) {
    const Cell radius = radius_cell(r, n_r);
    const Cell phi = cell(turn * n_phi, n_phi - 1);
    const int next = phi.index + 1 < n_phi ? phi.index + 1 : 0;
    __global const float *near = texture + radius.index * n_phi * channels;
    __global const float *far = near + n_phi * channels;
    for (int c = 0; c < channels; ++c) {
        const float near_value = mix(near[phi.index * channels + c], near[next * channels + c], phi.along);
        const float far_value = mix(far[phi.index * channels + c], far[next * channels + c], phi.along);
        out[c] = mix(near_value, far_value, radius.along);
    }
}

// The same of a texture without azimuth.
void radial_fetch(__global const float *texture, const int n_r, const int channels, const float r, float *out) {
    const Cell radius = radius_cell(r, n_r);
    __global const float *near = texture + radius.index * channels;
    for (int c = 0; c < channels; ++c) {
        out[c] = mix(near[c], near[channels + c], radius.along);
    }
}

#endif
