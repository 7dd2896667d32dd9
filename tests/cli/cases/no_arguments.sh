texel
