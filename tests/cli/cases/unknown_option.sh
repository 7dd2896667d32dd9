texel bake cube.obj -o cube.texel --resolutoin 8
