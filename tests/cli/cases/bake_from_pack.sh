# A pack is a recipe, its meshes included; the same recipe gives the same bytes.
cp "$DATA"/cube.* . && texel bake cube.obj -o a.texel --recipe "$DATA/small.json" && texel bake --recipe a.texel -o b.texel && diff -r a.texel b.texel
