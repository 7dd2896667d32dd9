cp "$ROOT/samples/creature/creature.json" . && texel bake creature.json -r 24 --want density -o c.texel && texel check c.texel || exit
texel bake --recipe c.texel -o d.texel && diff -r c.texel d.texel && echo the same
