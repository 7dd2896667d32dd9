# Blanks and make's special characters in names.
mkdir 'a $b #c' && cp "$DATA"/cube.* 'a $b #c' && texel bake 'a $b #c/cube.obj' -o 'my pack.texel' --recipe "$DATA/small.json" --depfile cube.d && cat cube.d
