mkdir precious && touch precious/data
texel bake "$DATA/cube.obj" -o precious --recipe "$DATA/small.json"
status=$?
ls precious
exit $status
