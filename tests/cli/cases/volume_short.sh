printf "\000\002\000\002\000\00212" > v.df3
texel bake v.df3 -o x.texel
