# Where something cannot be written is found before the work: no stage after reading is timed, nothing is made.
mkdir full && touch full/of_something && ln -s nothing link.texel
texel bake "$DATA/cube.obj" -o full -v 2>&1 | grep -v -e '^texel: read' -e memory
texel bake "$DATA/cube.obj" -o link.texel; echo $?
texel bake "$DATA/cube.obj" -o cube.texel --report nowhere/report.json; echo $?
texel bake "$DATA/cube.obj" -o cube.texel --depfile full; echo $?
texel view "$DATA/cube.obj" -o nowhere/cube.png; echo $?
ls
