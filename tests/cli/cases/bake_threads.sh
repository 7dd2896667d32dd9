for n in 1 2 4; do texel bake "$ROOT/samples/crossing_shells/crossing_shells.obj" -o $n.texel -r 24 --samples 2 --threads $n || exit; done
diff -r 1.texel 2.texel && diff -r 1.texel 4.texel
