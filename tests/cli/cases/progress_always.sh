texel bake "$DATA/cube.obj" -o cube.texel --recipe "$DATA/small.json" --progress always 2>&1 | grep -c "\[#*\.*\] *[0-9]*% " | grep -qv "^0$" && echo shown
