from __future__ import annotations

import pytest

from jaxbrdf.data.texture_name import TextureName, texture_name

BASE, LINEAR = TextureName("base colour"), TextureName("base colour", linear=True)
NORMAL, OPENGL, DIRECTX = (TextureName("normal", convention) for convention in (None, "opengl", "directx"))
ROUGHNESS, METALLIC, PACKED, OTHER = (TextureName(role) for role in ("roughness", "metallic", "packed", "other"))


@pytest.mark.parametrize(
    ("stem", "said"),
    [
        # ambientCG
        ("Bricks102_1K-JPG_Color", BASE),
        ("Bricks102_16K-PNG_NormalGL", OPENGL),
        ("Bricks102_1K-JPG_NormalDX", DIRECTX),
        ("Metal049A_1K-JPG_Roughness", ROUGHNESS),
        ("Metal049A_1K-JPG_Metalness", METALLIC),
        ("Bricks102_1K-JPG_AmbientOcclusion", OTHER),
        ("Bricks102_1K-JPG_Displacement", OTHER),
        ("Metal049A", None),
        # Poly Haven
        ("cobblestone_floor_08_diff_1k", BASE),
        ("fabric_pattern_07_col_1_1k", BASE),
        ("cobblestone_floor_08_nor_gl_4k", OPENGL),
        ("cobblestone_floor_08_nor_dx_1k", DIRECTX),
        ("rusty_metal_rough_1k", ROUGHNESS),
        ("rough_wood_metal_1k", METALLIC),
        ("fabric_pattern_07_arm_1k", PACKED),
        ("rough_wood_disp_1k", OTHER),
        ("rough_wood_ao_1k", OTHER),
        # glTF and game engines
        ("T_Wall_ORM", PACKED),
        ("wall_occlusionRoughnessMetallic", PACKED),
        ("Wall_metallicRoughness", PACKED),
        ("metallic_roughness", PACKED),
        ("Material_baseColor", BASE),
        # plainly
        ("albedo", BASE),
        ("basecolor", BASE),
        ("Base_Color", BASE),
        ("DIFFUSE", BASE),
        ("wood-albedo-2048x2048", BASE),
        ("Wood_Color_1K", BASE),
        ("normal", NORMAL),
        ("wood_normal_map", NORMAL),
        ("wood_normal_16bit", NORMAL),
        ("wood-normal-ogl", OPENGL),
        ("Wood_Normal_OpenGL", OPENGL),
        ("wood normal DirectX", DIRECTX),
        ("roughness_map", ROUGHNESS),
        ("metallic", METALLIC),
        ("albedo_linear", LINEAR),
        ("BaseColor_lin_1k", LINEAR),
        ("color_raw", LINEAR),
        ("albedo_sRGB", BASE),
        # no map's name at the end
        ("rough_wood", None),
        ("normal_people", None),
        ("1k", None),
        ("", None),
    ],
)
def test_what_a_name_says(stem: str, said: TextureName | None) -> None:
    assert texture_name(stem) == said
    # a word that was told apart by its capitals alone is one word in capitals
    assert texture_name(stem.lower()) == said
