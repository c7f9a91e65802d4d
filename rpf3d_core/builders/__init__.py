"""What scenes name, built over their terrain where there is more to it than copying numbers."""
