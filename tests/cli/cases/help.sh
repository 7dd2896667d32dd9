texel --help
