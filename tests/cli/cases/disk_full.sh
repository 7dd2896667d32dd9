texel --help > /dev/full
