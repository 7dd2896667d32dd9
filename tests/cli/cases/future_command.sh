texel convert a.texel --to vol -o b
