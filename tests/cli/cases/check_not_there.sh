texel check missing.texel
