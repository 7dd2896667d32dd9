texel --version
