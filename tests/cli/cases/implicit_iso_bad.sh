texel bake --implicit "x" --iso high -o x.texel
