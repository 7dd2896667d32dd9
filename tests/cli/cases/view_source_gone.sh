cp "$DATA"/cube.* . && texel bake cube.obj -o cube.texel --recipe "$DATA/small.json" && rm cube.obj && texel view cube.texel -o cube.png --truth
